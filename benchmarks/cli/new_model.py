"""``er-gym new-model``."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click

from benchmarks.cli.errors import bad_input, needing
from benchmarks.cli.options import FOLDER, MOST_SEED, overrides_option
from benchmarks.terminal import echo


@click.command(name="new-model")
@click.argument("architecture")
@click.option(
    "--data",
    "collections",
    multiple=True,
    required=True,
    type=FOLDER,
    help="A collection, or frames, from which the tokenizer learns; may be repeated.",
)
@click.option(
    "--dialect", default="paper", show_default=True, help="The dialect of the conversations."
)
@overrides_option("vocabulary=2048")
@click.option(
    "--seed",
    type=click.IntRange(0, MOST_SEED),
    default=0,
    show_default=True,
    help="The seed of the random weights.",
)
@click.option("--out", required=True, type=FOLDER, help="The directory of the model.")
def new_model(
    architecture: str,
    collections: tuple[Path, ...],
    dialect: str,
    overrides: tuple[str, ...],
    seed: int,
    out: Path,
) -> None:
    """Make a small model with random weights, to train it from scratch.

    ARCHITECTURE is a YAML file, or the name of one of er-gym's own. The tokenizer is trained on the
    conversations of collections and frames.
    """
    from agents.finetune.architecture import load_architecture
    from er_gym.activity import begin_import

    with bad_input():
        made = load_architecture(architecture, overrides)
        texts = _texts(collections, dialect)
    begin_import("PyTorch and transformers", "torch", "transformers")
    with needing("a new model", "er-gym[local]"):
        from agents.finetune.new_model import make_model
    with bad_input():
        make_model(made, texts, out, seed)
    size = sum(file.stat().st_size for file in out.glob("*.safetensors"))
    echo(f"{out}: {made.family}, {size // 4 / 1e6:.1f} million weights")


def _texts(collections: tuple[Path, ...], dialect: str) -> Iterator[str]:
    """The texts of all conversations, each turn after its role, as the model's chat format has it.
    The collections are opened at once, and read later.

    Raises:
        ValueError: there is no such dialect, or a directory holds no collection.
    """
    from er_gym.data.collection import Collection
    from er_gym.data.dialects import load_dialect
    from er_gym.data.frame_chat import frame_chat
    from er_gym.data.frames import FrameSet, is_frame_set

    words = load_dialect(dialect)
    opened = [
        FrameSet.open(path) if is_frame_set(path) else Collection.open(path) for path in collections
    ]
    chats = (
        chat
        for each in opened
        for chat in (
            (frame_chat(words, frame) for frame in each.frames())
            if isinstance(each, FrameSet)
            else (words.chat(trajectory) for trajectory in each.trajectories())
        )
    )
    return (f"{turn.role}\n{turn.text}" for chat in chats for turn in chat.turns)
