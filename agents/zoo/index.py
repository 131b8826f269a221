"""Finds the models of the zoo by name, and the agents that play with them. Imports no torch."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path

from agents.zoo.card import Card, Kind, read_card

PREFIX = "zoo:"
"""The prefix of an agent's name; the model's name follows."""
FOLDER = Path(__file__).parent / "models"
CARD = "card.yaml"
MOST_BYTES = 24_000_000
"""The most bytes of all files of all models together."""
SUFFIXES = (".safetensors", ".json", ".yaml", ".jinja", ".txt")
"""The only kinds of files that a model may have; none of them can run code."""


@dataclass(frozen=True)
class Player:
    """How the models of a kind are played.

    Attributes:
        prefix: of the agent that plays with a model's folder.
        extra: the extra of er-gym that this needs.
    """

    prefix: str
    extra: str


PLAYERS: Mapping[Kind, Player] = {
    "policy": Player("rl:", "rl"),
    "language model": Player("hf:", "local"),
}


@dataclass(frozen=True)
class ZooModel:
    """A model of the zoo.

    Attributes:
        name: the folder's.
        folder: holds its files.
        card: what is said of it.
    """

    name: str
    folder: Path
    card: Card

    @property
    def player(self) -> Player:
        """How it is played."""
        return PLAYERS[self.card.kind]

    @property
    def agent(self) -> str:
        """The agent that plays with its folder, such as ``rl:FOLDER``."""
        return f"{self.player.prefix}{self.folder}"


def model_names() -> tuple[str, ...]:
    """The names of all models, in alphabetical order."""
    return tuple(sorted(file.parent.name for file in FOLDER.glob(f"[!.]*/{CARD}")))


def find_model(name: str) -> ZooModel:
    """The model of a name.

    Raises:
        ValueError: there is none, and the message lists similar names; or its card is damaged.
    """
    if name not in model_names():
        near = get_close_matches(name, model_names(), n=3, cutoff=0.5)
        hint = f" (did you mean {' or '.join(near)}?)" if near else ""
        raise ValueError(
            f"there is no model {name!r:.80} in the zoo{hint}; give one of: "
            f"{', '.join(model_names()) or 'none'}; er-gym zoo describes them"
        )
    file = FOLDER / name / CARD
    return ZooModel(name, file.parent, _card(file, file.stat().st_mtime_ns))


def resolved(agent: str) -> str:
    """The agent behind the name ``zoo:NAME``; any other agent's name stays as it is.

    Raises:
        ValueError: as :func:`find_model`.
    """
    if not agent.startswith(PREFIX):
        return agent
    return find_model(agent.removeprefix(PREFIX)).agent


def files_of(folder: Path) -> Iterator[Path]:
    """The files in a model's folder, at whatever depth."""
    return (file for file in sorted(folder.rglob("*")) if not file.is_dir())


def weights_of(agent: str) -> dict[str, str]:
    """What tells the weights behind the name ``zoo:NAME`` from others: ``{"weights": DIGEST}``, the
    sha256 in hex of the files by which it plays; empty for another agent.

    Raises:
        ValueError: as :func:`find_model`.
    """
    if not agent.startswith(PREFIX):
        return {}
    total = hashlib.sha256()
    for file in files_of(find_model(agent.removeprefix(PREFIX)).folder):
        if file.name != CARD:
            total.update(file.read_bytes())
    return {"weights": total.hexdigest()}


@lru_cache(maxsize=32)
def _card(file: Path, changed: int) -> Card:
    return read_card(file)  # every episode asks; the file is read once while it is unchanged
