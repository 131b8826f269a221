"""Measures what a small vision-language model sees, beside a blind copy of itself.

    er-gym data frames --suite er-1k --frames 300 --width 448 --height 252 --out runs/unseen
    python -m benchmarks.vision_probe runs/ladder/er-tiny-vl/base runs/unseen

The model is shown pictures of rooms that it did not learn from, by the client that plays, and is
asked for all that is in view, and for single types. The blind copy is the same model, shown noise.
Noise may confuse a model more than it blinds it, so its answers are also held against the truth of
other frames: what is right then, it could have guessed without looking.
The dialect must have words for frames, such as ``sight``.
"""
