"""What goes wrong with a task file, with one of its tasks, or with an id in it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

_NAMED = 3


class TaskFileError(ValueError):
    """A file of tasks cannot be used; the message is one line that names the file and the place."""


@dataclass(frozen=True)
class SetAside:
    """A task of a file that is not played, while the others are.

    Attributes:
        task: its id, or where in the file it stands, if it has no id that can be used.
        reason: why not, in one line.
    """

    task: str
    reason: str

    def __str__(self) -> str:
        named = self.reason.startswith(self.task)
        return self.reason if named else f"{self.task}: {self.reason}"


@dataclass(frozen=True)
class Taken:
    """An object that stands for one that a task names and its scene lacks.

    Attributes:
        task_id, scene: where.
        named: the id that the task states; in its start, an object's name.
        taken: the id, or name, that the scene has.
        metres: how far off it is, None where no place is stated.
    """

    task_id: str
    scene: str
    named: str
    taken: str
    metres: float | None

    def __str__(self) -> str:
        off = "" if self.metres is None else f", {self.metres:.2f} m off"
        return f"{self.scene} has no {self.named}: {self.taken}{off}, is taken for it"


def in_short(set_aside: Sequence[SetAside]) -> str:
    """The first few tasks that were set aside, and how many more there are."""
    named = "; ".join(map(str, set_aside[:_NAMED]))
    more = len(set_aside) - _NAMED
    return f"{named}; and {more} more" if more > 0 else named


def told_once(taken: Iterable[Taken]) -> list[str]:
    """What was taken for what, each once, with the tasks that this concerns."""
    tasks: dict[str, list[str]] = {}
    for one in taken:
        tasks.setdefault(str(one), []).append(one.task_id)
    return [
        f"{said} ({', '.join(ids[:3])}{f' and {len(ids) - 3} more' if len(ids) > 3 else ''})"
        for said, ids in tasks.items()
    ]
