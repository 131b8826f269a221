"""What every task file format shares: reading, checking, and saying in one line what is wrong."""

from __future__ import annotations

import gzip
import json
import re
import zlib
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from er_gym.tasks import verbs
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.rooms import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, TaskType

Model = TypeVar("Model", bound=BaseModel)

_FILE_NAME_SAFE = re.compile(r"[\w+=.-]+")
_VERBS = frozenset(verbs.OBJECT_VERBS + verbs.BARE_VERBS)
_LONGEST_QUOTE = 60


def read_text(path: Path) -> str:
    """The text of a file, unpacked if its name ends in ``.gz``.

    Raises:
        TaskFileError: it is not there, is a folder, may not be read, or is not UTF-8 or gzip.
    """
    try:
        data = path.read_bytes()
        return (gzip.decompress(data) if path.suffix == ".gz" else data).decode()
    except FileNotFoundError:
        raise TaskFileError(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise TaskFileError(f"{path}: not UTF-8 text (byte {error.start})") from None
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise TaskFileError(f"{path}: not a whole gzip file: {error}") from None
    except OSError as error:
        raise TaskFileError(f"{path}: {error.strerror}") from None


def parse_json(text: str, path: Path, first_line: int = 1) -> object:
    """Parse JSON that starts at line ``first_line`` of a file.

    Raises:
        TaskFileError: it is not JSON; the message gives line and column.
    """
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        line = error.lineno + first_line - 1
        raise TaskFileError(
            f"{path}: not JSON: {error.msg} (line {line}, column {error.colno})"
        ) from None


def validated(model: type[Model], data: object, where: str) -> Model:
    """Build a pydantic model from parsed JSON.

    Raises:
        TaskFileError: it does not fit; the message is ``where`` and the first problem.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise TaskFileError(f"{where} {_first_problem(error)}") from None


def known_type(name: str, where: str) -> TaskType:
    """The task type of that name; a :class:`TaskFileError` lists those there are."""
    if name not in BY_NAME:
        raise TaskFileError(
            f"{where} has unknown tasktype {name!r}; choose one of: {', '.join(BY_NAME)}"
        )
    return BY_NAME[name]


def known_scene(name: str, where: str) -> str:
    """The scene's name, unchanged; a :class:`TaskFileError` says which scenes there are."""
    try:
        room_kind(name)
    except ValueError:
        raise TaskFileError(
            f"{where} has unknown scene {name!r}; "
            "choose one of FloorPlan1-30, FloorPlan201-230, FloorPlan301-330, FloorPlan401-430"
        ) from None
    return name


def known_verb(name: str, where: str) -> str:
    """The canonical spelling of a verb; a :class:`TaskFileError` lists those there are."""
    verb = verbs.canonical_verb(name)
    if verb not in _VERBS:
        allowed = ", ".join(verbs.OBJECT_VERBS + verbs.BARE_VERBS)
        raise TaskFileError(f"{where} has unknown action {name!r}; choose one of: {allowed}")
    return verb


def checked_ids(tasks: Iterable[Task], path: Path) -> list[Task]:
    """The tasks as a list, their ids unique and fit for file names, else a TaskFileError."""
    tasks = list(tasks)
    for task_id, count in Counter(task.id for task in tasks).items():
        if count > 1:
            raise TaskFileError(f"{path}: {count} tasks have the id {task_id!r}; it must be unique")
        if not _FILE_NAME_SAFE.fullmatch(task_id):
            raise TaskFileError(
                f"{path}: the task id {task_id!r} cannot be a file name; "
                "use letters, digits and any of + = . _ -"
            )
    return tasks


def _first_problem(error: ValidationError) -> str:
    """Pydantic's first complaint in words that fit behind the name of what is wrong."""
    problem = error.errors(include_url=False)[0]
    field = re.sub(r"\.(\d+)", r"[\1]", ".".join(map(str, problem["loc"])))
    if problem["type"] == "missing":
        return f"lacks field {field!r}"
    if problem["type"] == "value_error":  # one of our own validators, which says it all
        return f"has a wrong field {field!r}: {problem['ctx']['error']}"
    given = repr(problem["input"])
    if len(given) > _LONGEST_QUOTE:
        given = given[: _LONGEST_QUOTE - 1] + "…"
    message = problem["msg"][0].lower() + problem["msg"][1:]
    return f"has a wrong field {field!r}: {message}, not {given}" if field else f"is {given}"
