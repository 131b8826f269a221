"""er-gym's own task files: JSON lines, versioned and compact, with one task on each line.

The first line is a header: ``{"format": "er-gym/tasks/1", "tasks": 110, …}``. The number of tasks
shows whether a file was cut short. The writer may add fields that say how the file was made. The
line of a task has the fields of :class:`TaskRecord`, without those at their default. The line of an
arrangement (:class:`LayoutRecord`) stands before the first task that uses it. A file is compressed
if its name ends in ``.gz``.
"""

from __future__ import annotations

import gc
import gzip
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, astuple, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, field_validator

from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import (
    TaskFile,
    UnreadTask,
    as_utf8,
    known_scene,
    known_type,
    known_verb,
    validated,
)
from er_gym.tasks.goal import Condition
from er_gym.tasks.reading import read_json_lines
from er_gym.tasks.task import AgentPose, KeyAction, Task, type_of_id
from er_gym.writing import write_output

FORMAT = "er-gym/tasks/1"


class _Strict(BaseModel):
    """Refuses unknown fields, so that a misspelled field is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class KeyActionRecord(_Strict):
    """A key action; ``object_type`` None stands for the type that the object's id names."""

    verb: str
    object_id: str = ""
    object_type: str | None = None
    related_objects: tuple[str, ...] = ()
    reward: float = 1.0


class PoseRecord(_Strict):
    """A pose of the agent: metres and degrees, AI2-THOR's world frame."""

    x: float
    y: float
    z: float
    rotation: float
    horizon: float = 0.0
    standing: bool = True


class ConditionRecord(_Strict):
    """A condition of the goal; the fields are those of :class:`~er_gym.tasks.goal.Condition`."""

    object_type: str
    object_id: str = ""
    held: bool = False
    in_reach: bool = False
    inside: str = ""
    state: dict[str, bool | str] = {}

    @field_validator("state")
    @classmethod
    def _known(cls, state: dict[str, bool | str]) -> dict[str, bool | str]:
        Condition("", state=tuple(state.items()))
        return state

    @classmethod
    def of(cls, condition: Condition) -> ConditionRecord:
        """The record of a condition."""
        return cls(**{**vars(condition), "state": dict(condition.state)})

    def condition(self) -> Condition:
        """The condition that is recorded."""
        return Condition(**{**dict(self), "state": tuple(self.state.items())})


class LayoutRecord(_Strict):
    """An arrangement of a scene.

    Attributes:
        layout: the name by which tasks refer to it.
        poses: object name to x, y, z (metres) and pitch, yaw, roll (degrees), for moved objects.
    """

    layout: str
    poses: dict[str, tuple[float, float, float, float, float, float]]


class TaskRecord(_Strict):
    """A task: the fields of :class:`~er_gym.tasks.task.Task` and of its arrangement."""

    id: str
    type: str
    scene: str
    instruction: str
    name: str = ""
    key_actions: tuple[KeyActionRecord, ...]
    target_objects: tuple[str, ...] = ()
    related_objects: tuple[str, ...] = ()
    navigable_objects: tuple[str, ...] = ()
    goal: tuple[ConditionRecord, ...] = ()
    layout: str = ""
    dirty: tuple[str, ...] = ()
    poses: dict[str, PoseRecord] = {}
    extra: dict[str, Any] = {}


class Header(BaseModel):
    """The first line of a file."""

    model_config = ConfigDict(extra="allow")

    format: str
    tasks: int


def read_tasks(path: str | Path) -> list[Task]:
    """Read a task file.

    Raises:
        TaskFileError: the file or one of its tasks cannot be used; one line says where and why.
    """
    path = Path(path)
    return read_file(path).all_or_none(path)


def read_file(path: Path) -> TaskFile:
    """Read the usable tasks of a task file.

    Raises:
        TaskFileError: the file as a whole cannot be used.
    """
    with _no_search_for_garbage():
        return _read_file(path)


def _read_file(path: Path) -> TaskFile:
    lines = read_json_lines(path)
    header = _header(lines, path)
    entries = list(_entries(lines, path))
    if len(entries) != header.tasks:
        raise TaskFileError(
            f"{path}: cut short or edited: its header says {header.tasks} tasks, "
            f"and it has {len(entries)}"
        )
    return TaskFile.of(entries)


@contextmanager
def _no_search_for_garbage() -> Iterator[None]:
    """All that is read stays, and looking for garbage in it takes as long as reading."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def write_tasks(
    path: str | Path, tasks: Iterable[Task], *, force: bool = True, **made: object
) -> None:
    """Write a task file, completely or not at all.

    Args:
        path: the file; compressed if its name ends in ``.gz``.
        tasks: the tasks.
        force: whether to replace a file that er-gym did not write.
        made: further fields of the header: generator, seed, …

    Raises:
        ValueError: two tasks have different arrangements with the same name, or a text holds a
            lone surrogate.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    path, tasks = Path(path), list(tasks)
    header = json.dumps({"format": FORMAT, "tasks": len(tasks), **made}, ensure_ascii=False)
    data = as_utf8("\n".join([header, *_lines(tasks)]) + "\n", path)
    packed = gzip.compress(data, mtime=0) if path.suffix == ".gz" else data
    write_output(path, packed, force=force)


def digest(tasks: Iterable[Task]) -> str:
    """The sha256, in hex, of tasks in their order, without ``extra``.

    Equal tasks have the same digest, whichever format they were read from.
    """
    total = hashlib.sha256(FORMAT.encode())
    for line in _lines(replace(task, extra={}) for task in tasks):
        total.update(b"\n" + line.encode())
    return total.hexdigest()


def task_lines(task: Task) -> tuple[str, ...]:
    """The lines of a task in a file, without a header."""
    return tuple(_lines([task]))


def task_of_lines(lines: Iterable[str]) -> Task:
    """The task of :func:`task_lines`.

    Raises:
        TaskFileError: the lines are not those of a task.
    """
    numbered = ((number, json.loads(line)) for number, line in enumerate(lines, 1))
    *_, entry = _entries(numbered, Path("a saved task"))
    return entry.read()


def _lines(tasks: Iterable[Task]) -> Iterator[str]:
    """A line for each task; the line of an arrangement stands before its first task."""
    written: dict[str, Mapping[str, ObjectPose]] = {}
    for task in tasks:
        arrangement = task.arrangement
        if arrangement.poses and arrangement.layout not in written:
            written[arrangement.layout] = arrangement.poses
            poses = {name: astuple(pose) for name, pose in arrangement.poses.items()}
            yield _line(LayoutRecord(layout=arrangement.layout, poses=poses))
        if arrangement.poses != written.get(arrangement.layout, {}):
            raise ValueError(
                f"task {task.id}: another arrangement is named {arrangement.layout!r} too"
            )
        yield _line(_record(task))


def _header(lines: Iterator[tuple[int, object]], path: Path) -> Header:
    where = f"{path}: the header"
    _, data = next(lines, (0, None))
    if data is None:
        raise TaskFileError(f'{path}: empty; its first line should be {{"format": "{FORMAT}", …}}')
    header = validated(Header, data, where)
    if header.format != FORMAT:
        raise TaskFileError(f"{where} says format {header.format!r}; this er-gym reads {FORMAT!r}")
    return header


def _entries(lines: Iterable[tuple[int, object]], path: Path) -> Iterator[UnreadTask]:
    layouts: dict[str, dict[str, ObjectPose]] = {}
    for number, data in lines:
        if isinstance(data, dict) and "layout" in data and "id" not in data:
            layout = validated(LayoutRecord, data, f"{path}: the layout in line {number}")
            layouts[layout.layout] = {
                name: ObjectPose(*pose) for name, pose in layout.poses.items()
            }
        else:
            yield _entry(data, f"the task in line {number}", dict(layouts))


def _entry(data: object, where: str, layouts: Mapping[str, Mapping[str, ObjectPose]]) -> UnreadTask:
    def read() -> Task:
        record = validated(TaskRecord, data, where)
        if record.layout and record.layout not in layouts:
            raise TaskFileError(f"{where} names a layout that no earlier line defines")
        return _task(record, layouts.get(record.layout, {}), where)

    stated = data.get("id") if isinstance(data, dict) else None
    return UnreadTask(where, stated if isinstance(stated, str) else "", read)


def _task(record: TaskRecord, poses: Mapping[str, ObjectPose], where: str) -> Task:
    return Task(
        id=record.id,
        type=known_type(record.type, where),
        scene=known_scene(record.scene, where),
        instruction=record.instruction,
        name=record.name,
        key_actions=tuple(_key_action(action, where) for action in record.key_actions),
        target_objects=record.target_objects,
        related_objects=record.related_objects,
        navigable_objects=record.navigable_objects,
        goal=tuple(condition.condition() for condition in record.goal),
        arrangement=Arrangement(record.layout, poses, record.dirty),
        poses={key: AgentPose(**pose.model_dump()) for key, pose in record.poses.items()},
        extra=record.extra,
    )


def _key_action(record: KeyActionRecord, where: str) -> KeyAction:
    stated = record.object_type
    return KeyAction(
        verb=known_verb(record.verb, where),
        object_id=record.object_id,
        object_type=type_of_id(record.object_id) if stated is None else stated,
        related_objects=record.related_objects,
        reward=record.reward,
    )


def _record(task: Task) -> TaskRecord:
    return TaskRecord(
        id=task.id,
        type=task.type.name,
        scene=task.scene,
        instruction=task.instruction,
        name=task.name,
        key_actions=tuple(_key_action_record(action) for action in task.key_actions),
        target_objects=task.target_objects,
        related_objects=task.related_objects,
        navigable_objects=task.navigable_objects,
        goal=tuple(map(ConditionRecord.of, task.goal)),
        layout=task.arrangement.layout,
        dirty=task.arrangement.dirty,
        poses={key: PoseRecord(**asdict(pose)) for key, pose in task.poses.items()},
        extra=dict(task.extra),
    )


def _key_action_record(action: KeyAction) -> KeyActionRecord:
    usual = action.object_type == type_of_id(action.object_id)
    return KeyActionRecord(
        verb=action.verb,
        object_id=action.object_id,
        object_type=None if usual else action.object_type,
        related_objects=action.related_objects,
        reward=action.reward,
    )


def _line(record: BaseModel) -> str:
    return record.model_dump_json(exclude_defaults=True)
