"""``er-gym new-model``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import click

from benchmarks.cli.errors import BadInput, bad_input, needing
from benchmarks.cli.options import EXISTING_FILE, FOLDER, MOST_SEED, overrides_option
from benchmarks.terminal import echo


@click.command(name="new-model")
@click.argument("architecture", required=False)
@click.option(
    "--data",
    "collections",
    multiple=True,
    type=FOLDER,
    help="A collection, or frames, from which the tokenizer learns; may be repeated.",
)
@click.option(
    "--from-gguf",
    "gguf",
    type=EXISTING_FILE,
    help="Instead of ARCHITECTURE and --data: the language model in this GGUF file.",
)
@click.option(
    "--random-weights",
    is_flag=True,
    help="With --from-gguf: the file's architecture and tokenizer with random weights.",
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
    architecture: str | None,
    collections: tuple[Path, ...],
    gguf: Path | None,
    random_weights: bool,
    dialect: str,
    overrides: tuple[str, ...],
    seed: int,
    out: Path,
) -> None:
    """Make a model to train: a small one with random weights, or a pretrained one of a GGUF file.

    ARCHITECTURE is a YAML file, or the name of one of er-gym's own. The tokenizer is trained on the
    conversations of collections and frames. A GGUF file brings its own architecture and tokenizer.
    """
    from er_gym.activity import begin_import

    if gguf is None:
        make = _from_nothing(architecture, collections, dialect, overrides, seed, random_weights)
    elif architecture is not None or collections or overrides:
        raise BadInput("--from-gguf takes no ARCHITECTURE, --data or --set: the file has its own")
    else:
        make = _from_gguf(gguf, seed if random_weights else None)
    begin_import("PyTorch and transformers", "torch", "transformers")
    with bad_input():
        made = make(out)
    size = sum(file.stat().st_size for file in made.glob("*.safetensors"))
    family = json.loads((made / "config.json").read_text(encoding="utf-8"))["model_type"]
    echo(f"{made}: {family}, {size // 4 / 1e6:.1f} million weights")


def _from_gguf(file: Path, random_seed: int | None) -> Callable[[Path], Path]:
    """What makes the model of a GGUF file in a directory."""

    def make(out: Path) -> Path:
        with needing("a model of a GGUF file", "er-gym[gguf]"):
            from agents.finetune.gguf_model import model_of_gguf
        return model_of_gguf(file, out, random_seed)

    return make


def _from_nothing(
    architecture: str | None,
    collections: tuple[Path, ...],
    dialect: str,
    overrides: tuple[str, ...],
    seed: int,
    random_weights: bool,
) -> Callable[[Path], Path]:
    """What makes a new model in a directory; everything that is given is checked at once."""
    from agents.finetune.architecture import load_architecture

    if architecture is None or not collections:
        raise BadInput(
            "give an ARCHITECTURE and --data, from which the tokenizer learns, or --from-gguf FILE"
        )
    if random_weights:
        raise BadInput("--random-weights is for --from-gguf: other new models have no others")
    with bad_input():
        made = load_architecture(architecture, overrides)
        texts = _texts(collections, dialect)

    def make(out: Path) -> Path:
        with needing("a new model", "er-gym[local]"):
            from agents.finetune.new_model import make_model
        return make_model(made, texts, out, seed)

    return make


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
