"""What is in a ShareGPT file, and what is wrong with it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, TypeAlias

from er_gym.data.chat import IMAGE, Role
from er_gym.data.exports.paper import DECISION
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN
from er_gym.data.json_items import JsonItems
from er_gym.data.pictures import UnusablePicture, check_picture, picture_size
from er_gym.data.sharegpt_pictures import PicturePlaces
from er_gym.envs.actions import Action, parse

ProblemKind: TypeAlias = Literal[
    "layout",
    "order",
    "empty reply",
    "placeholders",
    "missing picture",
    "unusable picture",
    "no decision",
]
TOLD: Mapping[ProblemKind, str] = {
    "layout": "are laid out otherwise",
    "order": "do not alternate between user and assistant",
    "empty reply": "have an empty reply",
    "placeholders": f"have another number of {IMAGE} than of pictures",
    "missing picture": "name a picture that is not there",
    "unusable picture": "name a picture that cannot be read",
    "no decision": f"have a reply that does not end in a known action in <{DECISION}>",
}
"""How each kind is told, after a number of samples."""
HARMLESS: frozenset[ProblemKind] = frozenset({"no decision"})
"""A conversation can be learnt from all the same, but no action can be read from it."""
_MOST_NAMED = 3
_DECIDED = re.compile(rf"<{DECISION}>([^<>]*)</{DECISION}>[\s.]*\Z")


@dataclass(frozen=True)
class Sample:
    """A sample, independent of the names of its columns.

    Attributes:
        id: ``""`` if it has none.
        roles, texts: of its messages, the system's included.
        images: the paths of its pictures.
        train: for each reply whether it is learnt; empty if that is not said.
        images_in: the key under which its pictures stand, or why there are none.
        wrong: why it cannot be read; then the rest, but for the id, is empty.
    """

    id: str = ""
    roles: tuple[Role, ...] = ()
    texts: tuple[str, ...] = ()
    images: tuple[str, ...] = ()
    train: tuple[bool, ...] = ()
    images_in: str = ""
    wrong: str = ""

    @property
    def has_feedback(self) -> bool:
        """Whether the user ever says ``<|feedback|>``: an action could not be done."""
        said = zip(self.roles, self.texts, strict=True)
        return any(role == "user" and FEEDBACK_TOKEN in text for role, text in said)


@dataclass(frozen=True)
class Report:
    """What is in a file.

    Attributes:
        path: the file.
        samples, replies, pictures: how many it has, those with problems included.
        with_feedback: how many samples have ``<|feedback|>``.
        counts: kind of problem to the number of samples that have it.
        first: kind of problem to the places and reasons of the first.
        unsound: how many samples have a problem that is not harmless.
        harmless: the kinds of problems that are.
    """

    path: Path
    samples: int
    replies: int
    pictures: int
    with_feedback: int
    counts: Mapping[ProblemKind, int]
    first: Mapping[ProblemKind, tuple[str, ...]]
    unsound: int
    harmless: frozenset[ProblemKind] = HARMLESS

    def lines(self) -> list[str]:
        """The report for people: what there is, then a line for each kind of problem."""
        lines = [
            f"{self.path}: {self.samples:,} samples, {self.replies:,} replies, {self.pictures:,} "
            f"pictures; samples with {FEEDBACK_TOKEN}: {self.with_feedback:,}"
        ]
        for kind, count in self.counts.items():
            lines.append(f"{count:,} {TOLD[kind]}: {'; '.join(self.first[kind])}")
        return lines

    def in_one_line(self) -> str:
        """The problems that are not harmless, with the first of each."""
        told = "; ".join(
            f"{count:,} {TOLD[kind]} (first: {self.first[kind][0]})"
            for kind, count in self.counts.items()
            if kind not in self.harmless
        )
        return f"{self.path}: of {self.samples:,} samples, {told or 'none has a problem'}"


@dataclass
class Problems:
    """Checks one sample after the other.

    Attributes:
        harmless: kinds of problems that do not exclude a sample.
        decode: whether each picture is decoded, once however many samples show it.
    """

    harmless: frozenset[ProblemKind] = HARMLESS
    decode: bool = False
    samples: int = 0
    replies: int = 0
    pictures: int = 0
    with_feedback: int = 0
    unsound: int = 0
    counts: Counter[ProblemKind] = field(default_factory=Counter)
    first: dict[ProblemKind, list[tuple[int, str]]] = field(default_factory=dict)
    _whole: set[int] = field(default_factory=set)
    """The hashes of the paths of pictures that were decoded."""

    def look(self, index: int, sample: Sample, places: PicturePlaces) -> bool:
        """Count the problems of a sample; returns whether it can be trained on."""
        self.samples += 1
        self.replies += sample.roles.count("assistant")
        self.pictures += len(sample.images)
        self.with_feedback += sample.has_feedback
        found = self.of(sample, places)
        for kind, why in found.items():
            self.counts[kind] += 1
            named = self.first.setdefault(kind, [])
            if len(named) < _MOST_NAMED:
                named.append((index, why))
        sound = self.harmless.issuperset(found)
        self.unsound += not sound
        return sound

    def of(self, sample: Sample, places: PicturePlaces) -> dict[ProblemKind, str]:
        """What is wrong with a sample: of each kind the first."""
        return _problems_of(sample, places, self._check)

    def _check(self, picture: Path) -> None:
        if not self.decode:
            picture_size(picture)
        elif hash(picture) not in self._whole:
            check_picture(picture)
            self._whole.add(hash(picture))


def report_of(items: JsonItems, problems: Problems) -> Report:
    """The report, once all samples were looked at."""
    return Report(
        path=items.path,
        samples=problems.samples,
        replies=problems.replies,
        pictures=problems.pictures,
        with_feedback=problems.with_feedback,
        counts={kind: problems.counts[kind] for kind in TOLD if problems.counts[kind]},
        first={
            kind: tuple(f"item {index} (line {items.line(index)}): {why}" for index, why in named)
            for kind, named in problems.first.items()
        },
        unsound=problems.unsound,
        harmless=problems.harmless,
    )


def decision(reply: str) -> Action | None:
    """The action at the end of a reply, None if there is none that is known."""
    found = _DECIDED.search(reply)
    return parse(found[1].strip().strip(".")) if found else None


def _problems_of(
    sample: Sample, places: PicturePlaces, check: Callable[[Path], None]
) -> dict[ProblemKind, str]:
    if sample.wrong:
        return {"layout": sample.wrong}
    found: list[tuple[ProblemKind, str]] = []
    first = 1 if sample.roles[0] == "system" else 0
    for number, role in enumerate(sample.roles[first:]):
        wanted = "assistant" if number % 2 else "user"
        if role != wanted:
            found.append(("order", f"message {number + first} is {role}, not {wanted}"))
            break
    else:
        if sample.roles[-1] != "assistant":
            found.append(("order", "the last message is not the assistant's"))
    shown = 0
    for number, (role, text) in enumerate(zip(sample.roles, sample.texts, strict=True)):
        count = text.count(IMAGE)
        shown += count
        if role != "user" and count:
            found.append(("layout", f"message {number}, of the {role}, shows a picture"))
        if role == "assistant" and not text.strip():
            found.append(("empty reply", f"message {number}"))
        elif role == "assistant" and decision(text) is None:
            found.append(("no decision", f"message {number} ends in {text[-40:]!r}"))
    if shown != len(sample.images):
        where = f" in {sample.images_in!r:.60}" if sample.images else f": {sample.images_in}"
        found.append(("placeholders", f"{shown} places, {len(sample.images)} pictures{where}"))
    for path in sample.images:
        if not places.has(path):
            found.append(("missing picture", places.missing(path)))
            continue
        try:
            check(places.folder / places.path_of(path))
        except UnusablePicture as error:
            found.append(("unusable picture", str(error)[:300]))
    return dict(reversed(found))
