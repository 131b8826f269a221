"""Measures what a small vision-language model sees, beside a blind copy of itself.

    er-gym data frames --suite er-1k --frames 300 --width 448 --height 252 --out runs/unseen
    python -m benchmarks.vision_probe runs/ladder/er-tiny-vl/base runs/unseen

The client of the agents shows the model pictures of rooms that it was not trained on, and asks for
all types in view, and about single types. The blind copy is the same model, shown noise. Noise may
confuse a model more than missing vision would, so its answers are also scored against the labels of
other frames: this score is what guessing reaches. The dialect must have words for frames, such as
``sight``.
"""
