"""Thoughts that somebody wrote about real scenes, with what the critic makes of each.

A file of them is a list of records: ``scene`` (``"101:3"``: the episode of that seed of the suite
mini, at that turn), ``language``, ``sort`` (``honest``, or the sort of lie), ``text``.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from benchmarks.harness import played_turns
from er_gym.data.critic import check
from er_gym.data.knowledge import Knowledge, knowledge_at
from er_gym.data.thought import Refusal
from er_gym.data.trajectory import Language, Turn

HONEST = "honest"
"""The sort of thoughts that are no lies."""
LIMIT = 200
"""The most words of a thought."""


@dataclass(frozen=True)
class Written:
    """A thought as somebody wrote it.

    Attributes:
        scene: seed and turn, ``"101:3"``.
        language, sort, text: as the module says.
    """

    scene: str
    language: Language
    sort: str
    text: str


@dataclass(frozen=True)
class Judged:
    """A thought with what was known when it is thought, and why it is refused, if it is."""

    written: Written
    known: Knowledge
    refusals: tuple[Refusal, ...]

    @property
    def right(self) -> bool:
        """Whether a lie is refused, or an honest thought is not."""
        return bool(self.refusals) != (self.written.sort == HONEST)

    @property
    def verdict(self) -> str:
        """The codes of its refusals, or ``""``."""
        return " ".join(sorted({each.code for each in self.refusals}))


def load(path: Path) -> list[Written]:
    """The thoughts of a file.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no list of such records.
    """
    names = ("scene", "language", "sort", "text")
    try:
        records = json.loads(path.read_text(encoding="utf-8"))
        return [Written(*(str(each[name]) for name in names)) for each in records]  # type: ignore[arg-type]
    except (KeyError, TypeError) as error:
        raise ValueError(f"{path} is no list of thoughts: {error!r}") from None


@cache
def _played(seed: int) -> tuple[str, list[Turn]]:
    return next(iter(played_turns.play((seed,))))


def known_at(scene: str, language: Language) -> Knowledge:
    """What the agent knows in a scene, ``"101:3"``."""
    seed, turn = map(int, scene.split(":"))
    instruction, turns = _played(seed)
    return knowledge_at(turns, turn, instruction=instruction, language=language)


def judge(thoughts: Iterable[Written]) -> Iterator[Judged]:
    """Let the critic read each."""
    for one in thoughts:
        known = known_at(one.scene, one.language)
        yield Judged(one, known, check(one.text, "reasoning", known, limit=LIMIT))
