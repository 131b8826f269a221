"""Checks that all task file formats share; each error is one line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TypeVar, get_args

from pydantic import BaseModel, ValidationError

from er_gym.tasks import verbs
from er_gym.tasks.errors import SetAsideTask, TaskFileError
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import TaskType, task_type

Model = TypeVar("Model", bound=BaseModel)

_FILE_NAME_SAFE = re.compile(r"[\w+=.-]+")
_LONGEST_QUOTE = 60
MOST_TASKS = 50_000
"""The most tasks in one file; the suite ``train`` has 10,000."""


def as_utf8(text: str, path: Path) -> bytes:
    """Encode a text for a file.

    Raises:
        TaskFileError: the text holds a lone surrogate (half a character), which UTF-8 cannot hold.
    """
    try:
        return text.encode()
    except UnicodeEncodeError as error:
        half = error.object[error.start]
        raise TaskFileError(
            f"{path}: cannot be written: a text holds a lone surrogate (half a character), {half!r}"
        ) from None


def validated(model: type[Model], data: object, where: str | Callable[[str], str]) -> Model:
    """Build a pydantic model from parsed JSON.

    Args:
        where: what the data are, for the message; or a function that says so for the path of a
            field (``evaluation.every``).

    Raises:
        TaskFileError: the data do not fit; the message is ``where`` and the first problem.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        place = ".".join(map(str, error.errors(include_url=False)[0]["loc"]))
        place = where if isinstance(where, str) else where(place)
        raise TaskFileError(f"{place} {_first_problem(error, model)}") from None


def known_type(name: str, where: str) -> TaskType:
    """The task type of a name; for an unknown one a :class:`TaskFileError` lists the known."""
    try:
        return task_type(name)
    except ValueError as error:
        raise TaskFileError(f"{where}: {error}") from None


def known_scene(name: str, where: str) -> str:
    """The scene name, unchanged; for an unknown one a :class:`TaskFileError` lists the known."""
    try:
        room_kind(name)
    except ValueError:
        raise TaskFileError(
            f"{where} has unknown scene {name!r}; "
            "choose one of FloorPlan1-30, FloorPlan201-230, FloorPlan301-330, FloorPlan401-430, "
            "or a house such as House3-17"
        ) from None
    return name


def known_verb(name: str, where: str) -> str:
    """A verb's canonical spelling; for an unknown one a :class:`TaskFileError` lists the known."""
    verb = verbs.canonical_verb(name)
    known = verbs.OBJECT_VERBS + verbs.BARE_VERBS
    if verb not in known:
        raise TaskFileError(
            f"{where} has unknown action {name!r}; choose one of: {', '.join(known)}"
        )
    return verb


@dataclass(frozen=True)
class UnreadTask:
    """A task in a file before it is read.

    Attributes:
        where: its place in the file, for messages.
        id: the id that it states, "" if it states none.
        read: returns the task, or raises a :class:`TaskFileError` that begins with ``where``.
    """

    where: str
    id: str
    read: Callable[[], Task]


@dataclass(frozen=True)
class TaskFile:
    """The content of a task file.

    Attributes:
        tasks: the usable tasks in the file's order; their ids are unique and usable as file names.
        places: the number of each of them among all tasks of the file, from 1.
        set_aside: the other tasks, and why they cannot be used.
    """

    tasks: tuple[Task, ...]
    places: tuple[int, ...] = ()
    set_aside: tuple[SetAsideTask, ...] = ()

    @classmethod
    def of(cls, entries: Iterable[UnreadTask]) -> TaskFile:
        """Read tasks one after another; a faulty task is set aside and the others are used.

        If several tasks have the same id, the first is used.

        Raises:
            TaskFileError: there are more than :data:`MOST_TASKS`.
        """
        tasks: dict[str, Task] = {}
        places: list[int] = []
        set_aside: list[SetAsideTask] = []
        first: dict[str, str] = {}
        for place, entry in enumerate(entries, 1):
            if place > MOST_TASKS:
                raise TaskFileError(f"more than {MOST_TASKS:,} tasks; give them in several files")
            try:
                task = entry.read()
            except TaskFileError as error:
                set_aside.append(SetAsideTask(entry.id or entry.where, str(error)))
                continue
            problem = ""
            if not _FILE_NAME_SAFE.fullmatch(task.id):
                problem = (
                    f"has the task id {task.id!r}, which cannot be a file name; "
                    "use letters, digits and any of + = . _ -"
                )
            elif task.id in tasks:
                problem = f"has the id {task.id!r}, as {first[task.id]} has; it must be unique"
            if problem:
                set_aside.append(SetAsideTask(entry.where, f"{entry.where} {problem}"))
            else:
                tasks[task.id], first[task.id] = task, entry.where
                places.append(place)
        return cls(tuple(tasks.values()), tuple(places), tuple(set_aside))

    def all_or_none(self, path: Path) -> list[Task]:
        """The tasks, if none was set aside.

        Raises:
            TaskFileError: a task was set aside; the message gives the reason of the first.
        """
        if self.set_aside:
            raise TaskFileError(f"{path}: {self.set_aside[0].reason}")
        return list(self.tasks)


def _first_problem(error: ValidationError, model: type[BaseModel]) -> str:
    """The first problem that pydantic found, worded to follow the name of the faulty record."""
    problem = error.errors(include_url=False)[0]
    field = re.sub(r"\.(\d+)", r"[\1]", ".".join(map(str, problem["loc"])))
    if problem["type"] == "missing":
        return f"lacks field {field!r}"
    if problem["type"] == "value_error":  # one of our own validators: the message is complete
        return f"has a wrong field {field!r}: {problem['ctx']['error']}"
    if problem["type"] == "extra_forbidden":
        *way, name = problem["loc"]
        return (
            f"has a wrong field {field!r}: there is no such field{_known_fields(model, way, name)}"
        )
    given = repr(problem["input"])
    if len(given) > _LONGEST_QUOTE:
        given = given[: _LONGEST_QUOTE - 1] + "…"
    message = problem["msg"][0].lower() + problem["msg"][1:]
    return f"has a wrong field {field!r}: {message}, not {given}" if field else f"is {given}"


def _known_fields(model: type[BaseModel], way: Iterable[int | str], name: int | str) -> str:
    """What else a field can be named, where ``way`` leads from a model; "" if that is not known."""
    part: type[BaseModel] | None = model
    for step in way:
        if part is None or step not in part.model_fields:
            return ""
        kinds = part.model_fields[str(step)].annotation
        part = next((each for each in (kinds, *get_args(kinds)) if _is_model(each)), None)
    if part is None:
        return ""
    near = get_close_matches(str(name), part.model_fields, n=1)
    meant = f" (did you mean {near[0]}?)" if near else ""
    return f"{meant}; there are: {', '.join(part.model_fields)}"


def _is_model(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
