"""A grammar of instructions: frames around cores, whole sentences, and ways to join clauses.

A core says what is to be done ("find the {object} in the {room}"), a frame asks for it ("Could you
{core}?"). A wording is a frame with a core, or a whole sentence. Those with an unseen part are kept
for evaluation: no training task is told in them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle, islice
from typing import Generic, Literal, TypeVar

Wording = Literal["seen", "unseen"]
"""Whether training sees a wording, or it is kept for evaluation."""
_Part = TypeVar("_Part")


@dataclass(frozen=True)
class Parts(Generic[_Part]):
    """Parts of one sort.

    Attributes:
        seen: those that any task may use.
        unseen: those that only evaluation uses.
    """

    seen: tuple[_Part, ...]
    unseen: tuple[_Part, ...]

    @property
    def all(self) -> tuple[_Part, ...]:
        """Both."""
        return (*self.seen, *self.unseen)


@dataclass(frozen=True)
class Style:
    """A way to join clauses. Each part holds {clause}, and may hold {number}, counted from 1.

    Attributes:
        alone: the whole instruction if there is only one clause.
        first: the first of several clauses.
        between: the clauses after the first, used in turn, each with its separator.
        last: the last of three or more clauses.
        end: the final punctuation mark, perhaps with words before it.
    """

    alone: str
    first: str
    between: tuple[str, ...]
    last: str
    end: str = "."

    def join(self, clauses: Sequence[str]) -> str:
        """The clauses as an instruction, without a capital letter at its beginning."""
        parts = [self.alone] if len(clauses) == 1 else [self.first]
        parts += islice(cycle(self.between), len(clauses) - 1)
        if len(clauses) > 2:
            parts[-1] = self.last
        text = "".join(
            part.format(clause=clause, number=number)
            for number, (part, clause) in enumerate(zip(parts, clauses, strict=True), 1)
        )
        return text + self.end


@dataclass(frozen=True)
class Joiner:
    """The clauses of :class:`Style` after a frame's opening words, without those words."""

    first: str
    between: tuple[str, ...]
    last: str


@dataclass(frozen=True)
class Sentences:
    """What one kind of task can be told by.

    Attributes:
        whole: sentences that take no frame; the first of them gives tasks their names.
        cores: what frames are put around.
    """

    whole: Parts[str]
    cores: Parts[str]


@dataclass(frozen=True)
class Grammar:
    """The wordings of a language.

    Attributes:
        frames: each holds {core} once.
        sentences: by kind of task.
        styles: whole ways to join clauses, and ``joiners``, to be put into frames.
        verbs: the first words of clauses to others that mean the same.
    """

    frames: Parts[str]
    sentences: Mapping[str, Sentences]
    styles: Parts[Style]
    joiners: Parts[Joiner]
    verbs: Mapping[str, Parts[str]]

    @cached_property
    def templates(self) -> Mapping[str, Parts[str]]:
        """The templates of each kind of task."""
        found = {}
        for kind, own in self.sentences.items():
            seen = dict.fromkeys(_framed(self.frames.seen, own.cores.seen, own.whole.seen))
            unseen = dict.fromkeys(
                (
                    *_framed(self.frames.unseen, own.cores.all, own.whole.unseen),
                    *_framed(self.frames.seen, own.cores.unseen, ()),
                )
            )
            found[kind] = Parts(tuple(seen), tuple(each for each in unseen if each not in seen))
        return found

    @cached_property
    def orders(self) -> Parts[Style]:
        """The ways to join clauses."""
        framed = {
            (kept_frame, kept_joiner): [
                _style(frame, joiner)
                for frame in getattr(self.frames, kept_frame)
                for joiner in getattr(self.joiners, kept_joiner)
            ]
            for kept_frame in ("seen", "unseen")
            for kept_joiner in ("seen", "unseen")
        }
        seen = framed.pop(("seen", "seen"))
        return Parts(
            (*self.styles.seen, *seen),
            (*self.styles.unseen, *(style for rows in framed.values() for style in rows)),
        )


def _framed(frames: Sequence[str], cores: Sequence[str], whole: Sequence[str]) -> Iterator[str]:
    yield from whole
    for frame in frames:
        for core in cores:
            yield capital(frame.replace("{core}", core))


def _style(frame: str, joiner: Joiner) -> Style:
    opening, _, end = frame.partition("{core}")
    return Style(opening + "{clause}", opening + joiner.first, joiner.between, joiner.last, end)


def capital(text: str) -> str:
    """A text with a capital letter at its beginning, unless that is a field."""
    return text if text.startswith("{") else text[:1].upper() + text[1:]
