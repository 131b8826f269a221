"""Problems of files: the errors, tasks that are set aside, ids that are substituted."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from pydantic import ValidationError

_NAMED = 3


class TaskFileError(ValueError):
    """A task file cannot be used; the message is one line that names the file and the place."""


def first_problem(error: Exception, whole: str = "the file") -> str:
    """An error in one line; of what pydantic found, the first with its place.

    Args:
        error: any.
        whole: what is named if the data as a whole are wrong, such as no JSON.
    """
    if not isinstance(error, ValidationError):
        return " ".join(str(error).split())
    first = error.errors(include_url=False, include_input=False)[0]
    where = ".".join(map(str, first["loc"])) or whole
    return f"{where}: {' '.join(first['msg'].removeprefix('Value error, ').split())}"


@dataclass(frozen=True)
class SetAsideTask:
    """A task that cannot be played, while the other tasks of its file can.

    The fields are stored in ``run.json``.

    Attributes:
        task: its id, or its place in the file if it has no usable id.
        reason: why it cannot be played, in one line.
    """

    task: str
    reason: str

    def __str__(self) -> str:
        named = self.reason.startswith(self.task)
        return self.reason if named else f"{self.task}: {self.reason}"


@dataclass(frozen=True)
class Substitution:
    """An object of the scene that replaces an object that the task names and the scene lacks.

    The fields are stored in ``run.json``.

    Attributes:
        task_id, scene: the task and its scene.
        named: the id that the task states; in its arrangement, an object's name.
        taken: the id, or the name, that is used instead.
        metres: the distance between the two, None where the task states no position.
    """

    task_id: str
    scene: str
    named: str
    taken: str
    metres: float | None

    def __str__(self) -> str:
        away = "" if self.metres is None else f", {self.metres:.2f} m off"
        return f"{self.scene} has no {self.named}: {self.taken}{away}, is used instead"


def summarise_set_aside(set_aside: Sequence[SetAsideTask]) -> str:
    """One line: the first few tasks that were set aside, and the number of the others."""
    named = "; ".join(map(str, set_aside[:_NAMED]))
    more = len(set_aside) - _NAMED
    return f"{named}; and {more} more" if more > 0 else named


def describe_substitutions(substitutions: Iterable[Substitution]) -> list[str]:
    """One line for each different substitution, with the ids of its tasks."""
    tasks: dict[str, list[str]] = {}
    for substitution in substitutions:
        tasks.setdefault(str(substitution), []).append(substitution.task_id)
    return [
        f"{text} ({', '.join(ids[:3])}{f' and {len(ids) - 3} more' if len(ids) > 3 else ''})"
        for text, ids in tasks.items()
    ]
