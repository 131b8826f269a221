"""The paper's own file formats: test files, and the exact poses from which objects are reached.

A test file is a JSON list of objects. :func:`read_tasks` and :func:`write_tasks` are inverse to
each other, for the paper's files and for tasks of any other origin, except for ``Task.poses``.
``Task.extra`` keeps the fields for which :class:`~er_gym.tasks.task.Task` has no attribute:
``identity``, ``instruction_idx`` and other fields of a task's object under their own names, and
those that :mod:`~er_gym.tasks.paper_records` lists. Attributes for which the paper's format has no
field (our own id, the goal, the arrangement) are stored in the object under ``er_gym``.

A file may leave out fields that have a default (see :class:`PaperTask`); :func:`write_tasks` writes
them. A pose file is a JSON object, keyed by the tasks' identities.
:mod:`~er_gym.tasks.paper_generator` reads the files of the paper's generator.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from er_gym.tasks import paper_records
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import TaskFile, UnreadTask, known_scene, known_type, validated
from er_gym.tasks.task import AgentPose, Task
from er_gym.writing import write_output


class _Vector(BaseModel):
    model_config = ConfigDict(allow_inf_nan=False)

    x: float
    y: float
    z: float


class PaperPose(BaseModel):
    """An agent pose as the paper's files write it: metres and degrees, AI2-THOR's world frame."""

    model_config = ConfigDict(allow_inf_nan=False)

    agent_teleport_position: _Vector
    agent_cameraHorizon: float
    agent_isstanding: bool
    agent_rotation: _Vector


class PaperPoses(BaseModel):
    """The poses of one task: besides the three declared fields, one field per object id."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, PaperPose] = Field(init=False)

    scene: str
    tasktype: str
    taskname: str


def read_tasks(path: str | Path) -> list[Task]:
    """Read a test file of the paper.

    Returns:
        Tasks in the file's order. Their ids are those of ``er_gym`` or such as ``paper-57``.

    Raises:
        TaskFileError: the file or one of its tasks cannot be used; one line says where and why.
    """
    path = Path(path)
    return read_file(path).all_or_none(path)


def read_file(path: Path) -> TaskFile:
    """Read the usable tasks of a test file of the paper; see :func:`read_tasks`.

    Raises:
        TaskFileError: the file as a whole cannot be used.
    """
    example = 'the paper\'s task files look like [{"scene": …, "tasktype": …}, …]'
    data = paper_records.read_json(path, list, "tasks", example)
    if data and all(
        isinstance(item, dict) and {"scene", "task_metadata"}.isdisjoint(item) for item in data
    ):
        raise TaskFileError(
            f"{path}: not a test file: no task has a scene or task_metadata; if the paper's "
            "generator wrote it, read it with er_gym.tasks.paper_generator.read_generator_tasks"
        )
    return TaskFile.of(_entry(item, number) for number, item in enumerate(data, 1))


def _entry(data: object, number: int) -> UnreadTask:
    identity = data.get("identity") if isinstance(data, dict) else None
    stated = isinstance(identity, int | str) and not isinstance(identity, bool)
    where = f"task {number}" + (f" (identity {identity})" if stated else "")
    return UnreadTask(where, f"paper-{identity}" if stated else "", lambda: _read_task(data, where))


def write_tasks(path: str | Path, tasks: Iterable[Task], *, force: bool = True) -> None:
    """Write a test file in the paper's format; :func:`write_poses` writes ``Task.poses``.

    A task from another source has no identity. It gets its number in the file, from 1. If another
    task has that identity, the file's length is added until the number is free.

    Args:
        path: the file.
        tasks: the tasks.
        force: whether to replace an existing file; the format does not tell who wrote it.

    Raises:
        TaskFileError: a task's ``extra`` holds fields with which the task could not be read again.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    path, tasks = Path(path), list(tasks)
    records = [
        _task_record(task, identity, path, number)
        for number, (task, identity) in enumerate(_with_identities(tasks), 1)
    ]
    write_output(path, paper_records.as_json(path, records), force=force)


def read_poses(path: str | Path) -> dict[str, dict[str, AgentPose]]:
    """Read a pose file of the paper (``agent_positions.json``).

    Returns:
        Task identity to object id to the agent pose from which that object is reached.

    Raises:
        TaskFileError: the file cannot be used; one line says where and why.
    """
    example = 'the paper\'s pose files look like {"57": {"scene": …, …}, …}'
    data = paper_records.read_json(Path(path), dict, "poses", example)
    entries = {
        identity: validated(PaperPoses, entry, f"{path}: the poses of task {identity!r}:")
        for identity, entry in data.items()
    }
    return {
        identity: {
            object_id: _agent_pose(pose) for object_id, pose in entry.__pydantic_extra__.items()
        }
        for identity, entry in entries.items()
    }


def write_poses(path: str | Path, tasks: Iterable[Task]) -> None:
    """Write a pose file in the paper's format, for those tasks that state poses.

    The tasks have the identities that :func:`write_tasks` gives to the same list.

    Raises:
        TaskFileError: a text holds a lone surrogate.
        CannotWrite: the file cannot be written.
    """
    entries = {
        str(identity): {
            "scene": task.scene,
            "tasktype": task.type.name,
            "taskname": task.name,
            **{object_id: _pose_record(pose) for object_id, pose in task.poses.items()},
        }
        for task, identity in _with_identities(list(tasks))
        if task.poses
    }
    write_output(path, paper_records.as_json(Path(path), entries), force=True)


def with_poses(
    tasks: Iterable[Task],
    poses: Mapping[str, Mapping[str, AgentPose]],
    places: Sequence[int] = (),
) -> list[Task]:
    """The tasks, each with the poses that a pose file states for its identity.

    Args:
        tasks: the tasks.
        poses: task identity to object id to pose (:func:`read_poses`).
        places: the number of each task in its file, from 1, if some of the file's tasks are
            missing. :func:`write_tasks` derives a missing identity from this number.
    """
    return [
        replace(task, poses={**task.poses, **poses.get(str(identity), {})})
        for task, identity in _with_identities(list(tasks), places)
    ]


def with_every_pose(
    tasks: Iterable[Task], poses: Mapping[str, Mapping[str, AgentPose]] | None = None
) -> list[Task]:
    """The tasks, each with all poses of all tasks and of a pose file.

    The paper's program reads its pose file in this way: an object has the same pose in every task.
    If several poses are stated for one object, the last one counts.
    """
    tasks = list(tasks)
    every: dict[str, AgentPose] = {}
    for stated in (*(task.poses for task in tasks), *(poses or {}).values()):
        every |= stated
    return [replace(task, poses=every) for task in tasks]


def _with_identities(
    tasks: Sequence[Task], places: Sequence[int] = ()
) -> list[tuple[Task, object]]:
    places = places or range(1, len(tasks) + 1)
    taken = {str(task.extra["identity"]) for task in tasks if "identity" in task.extra}
    found: list[tuple[Task, object]] = []
    for place, task in zip(places, tasks, strict=True):
        number = place
        while str(number) in taken:
            number += places[-1]
        found.append((task, task.extra.get("identity", number)))
    return found


def _read_task(data: object, where: str) -> Task:
    paper = validated(paper_records.PaperTask, data, where)
    actions = paper.task_metadata.actions
    task = Task(
        id=f"paper-{paper.identity}",
        type=known_type(paper.tasktype, where),
        scene=known_scene(paper.scene, where),
        instruction=paper.taskquery or paper.taskname,
        name=paper.taskname,
        key_actions=paper_records.key_actions(actions, where),
        target_objects=tuple(paper.target_objects),
        related_objects=tuple(paper.related_objects),
        navigable_objects=tuple(paper.navigable_objects),
        extra={
            "identity": paper.identity,
            **paper_records.extra_fields(paper),
            "task_metadata": paper_records.extra_fields(paper.task_metadata),
            "actions": [paper_records.extra_action_fields(action) for action in actions],
        },
    )
    return paper_records.with_own_fields(task, paper.er_gym, where)


def _task_record(task: Task, identity: object, path: Path, number: int) -> dict[str, Any]:
    extra = paper_records.without_fields_of(task.extra, paper_records.PaperTask)
    extra.pop("actions", None)
    record = {
        "scene": task.scene,
        "tasktype": task.type.name,
        "taskname": task.name,
        "task_metadata": paper_records.metadata_record(task),
        "taskquery": task.instruction,
        "identity": identity,
        "target_objects": list(task.target_objects),
        "related_objects": list(task.related_objects),
        "navigable_objects": list(task.navigable_objects),
        **extra,
    }
    plain = _read_task(record, f"{path}: task {number} (identity {identity})")
    return record | paper_records.own_fields(replace(task, poses={}), plain)


def _agent_pose(pose: PaperPose) -> AgentPose:
    place = pose.agent_teleport_position
    return AgentPose(
        x=place.x,
        y=place.y,
        z=place.z,
        rotation=pose.agent_rotation.y,
        horizon=pose.agent_cameraHorizon,
        standing=pose.agent_isstanding,
    )


def _pose_record(pose: AgentPose) -> dict[str, Any]:
    return {
        "agent_teleport_position": {"x": pose.x, "y": pose.y, "z": pose.z},
        "agent_cameraHorizon": pose.horizon,
        "agent_isstanding": pose.standing,
        "agent_rotation": {"x": 0.0, "y": pose.rotation, "z": 0.0},
    }
