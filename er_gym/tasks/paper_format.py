"""The paper's own file formats: tasks, and the exact poses from which some objects are reached.

A task file is a JSON list of objects; :func:`read_tasks` and :func:`write_tasks` are inverse to
each other. What :class:`~er_gym.tasks.task.Task` has no field for travels in ``Task.extra``:

- ``identity``, ``instruction_idx`` and whatever else a task's object holds, under its own name;
- ``task_metadata``: that object without its list of actions;
- ``actions``: per key action, what :class:`~er_gym.tasks.task.KeyAction` has no field for.

A file may leave out what has an obvious default (see :class:`PaperTask`); written again, it is
there. A pose file is a JSON object, keyed by a task's identity.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from er_gym.tasks import verbs
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import (
    checked_ids,
    known_scene,
    known_type,
    known_verb,
    parse_json,
    read_text,
    validated,
)
from er_gym.tasks.task import AgentPose, KeyAction, Task

_SPELLED = {verbs.PUT: "put"}
"""Verbs that the paper's task files spell unlike its agents' replies."""


class _PaperModel(BaseModel):
    """Keeps fields that it does not know, so that they can be written again."""

    model_config = ConfigDict(extra="allow")


class PaperAction(_PaperModel):
    """A key action as the paper's files write it."""

    action: str
    objectId: str
    objectType: str
    relatedObject: list[str] = []
    reward: int | float = 1


class PaperMetadata(_PaperModel):
    """What the paper's generator knew of a task."""

    actions: list[PaperAction]


class PaperTask(_PaperModel):
    """A task as the paper's files write it."""

    scene: str
    tasktype: str
    taskname: str
    task_metadata: PaperMetadata
    taskquery: str | None = None
    identity: int | str
    target_objects: list[str] = []
    related_objects: list[str] = []
    navigable_objects: list[str] = []


class _Vector(BaseModel):
    x: float
    y: float
    z: float


class PaperPose(BaseModel):
    """A pose of the agent as the paper's files write it: metres and degrees, AI2-THOR's frame."""

    agent_teleport_position: _Vector
    agent_cameraHorizon: float
    agent_isstanding: bool
    agent_rotation: _Vector


class PaperPoses(BaseModel):
    """The poses of one task: beside the three named fields, one per object id."""

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, PaperPose] = Field(init=False)

    scene: str
    tasktype: str
    taskname: str


def read_tasks(path: str | Path) -> list[Task]:
    """Read a task file of the paper.

    Returns:
        Tasks in the file's order, with ids such as ``paper-57``.

    Raises:
        TaskFileError: the file cannot be used; one line says where and why.
    """
    path = Path(path)
    data = parse_json(read_text(path), path)
    if not isinstance(data, list):
        raise TaskFileError(
            f"{path}: not a list of tasks but {_kind(data)}; "
            'the paper\'s task files look like [{"scene": …, "tasktype": …}, …]'
        )
    return checked_ids((_read_task(item, path, n) for n, item in enumerate(data, 1)), path)


def write_tasks(path: str | Path, tasks: Iterable[Task]) -> None:
    """Write tasks as the paper's files do.

    A task that came from elsewhere and so has no identity gets its place in the file, from 1.
    """
    records = [_task_record(task, number) for number, task in enumerate(tasks, 1)]
    _write_json(Path(path), records)


def read_poses(path: str | Path) -> dict[str, dict[str, AgentPose]]:
    """Read a pose file of the paper (``agent_positions.json``).

    Returns:
        Identity of a task, to object id, to the pose from which that object is reached.

    Raises:
        TaskFileError: the file cannot be used; one line says where and why.
    """
    path = Path(path)
    data = parse_json(read_text(path), path)
    if not isinstance(data, dict):
        raise TaskFileError(
            f"{path}: not an object of poses but {_kind(data)}; "
            'the paper\'s pose files look like {"57": {"scene": …, …}, …}'
        )
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
    """Write the poses of those tasks that state any, as the paper's file does."""
    entries = {
        str(_identity(task, number)): {
            "scene": task.scene,
            "tasktype": task.type.name,
            "taskname": task.name,
            **{object_id: _pose_record(pose) for object_id, pose in task.poses.items()},
        }
        for number, task in enumerate(tasks, 1)
        if task.poses
    }
    _write_json(Path(path), entries)


def with_poses(tasks: Iterable[Task], poses: Mapping[str, Mapping[str, AgentPose]]) -> list[Task]:
    """The same tasks, each with the poses that a pose file states for its identity."""
    return [
        replace(task, poses={**task.poses, **poses.get(str(task.extra.get("identity")), {})})
        for task in tasks
    ]


def _read_task(data: object, path: Path, number: int) -> Task:
    identity = data.get("identity") if isinstance(data, dict) else None
    where = f"{path}: task {number}" + (f" (identity {identity})" if identity is not None else "")
    paper = validated(PaperTask, data, where)
    actions = paper.task_metadata.actions
    return Task(
        id=f"paper-{paper.identity}",
        type=known_type(paper.tasktype, where),
        scene=known_scene(paper.scene, where),
        instruction=paper.taskquery or paper.taskname,
        name=paper.taskname,
        key_actions=tuple(_key_action(action, where) for action in actions),
        target_objects=tuple(paper.target_objects),
        related_objects=tuple(paper.related_objects),
        navigable_objects=tuple(paper.navigable_objects),
        extra={
            "identity": paper.identity,
            **_unknown(paper),
            "task_metadata": _unknown(paper.task_metadata),
            "actions": [_unspoken(action) for action in actions],
        },
    )


def _key_action(action: PaperAction, where: str) -> KeyAction:
    return KeyAction(
        verb=known_verb(action.action, where),
        object_id=action.objectId,
        object_type=action.objectType,
        related_objects=tuple(action.relatedObject),
        reward=action.reward,
    )


def _unspoken(action: PaperAction) -> dict[str, Any]:
    """What of a key action :class:`KeyAction` does not tell, an odd spelling of the verb too."""
    usual = action.action == _spelled(verbs.canonical_verb(action.action))
    return _unknown(action) | ({} if usual else {"action": action.action})


def _task_record(task: Task, number: int) -> dict[str, Any]:
    extra = dict(task.extra)
    metadata = extra.pop("task_metadata", {})
    unspoken = extra.pop("actions", [{}] * len(task.key_actions))
    assert isinstance(metadata, Mapping)
    assert isinstance(unspoken, list)
    return {
        "scene": task.scene,
        "tasktype": task.type.name,
        "taskname": task.name,
        "task_metadata": {
            "taskname": task.name,
            "tasktype": task.type.name,
            "actions": [
                _action_record(action) | rest
                for action, rest in zip(task.key_actions, unspoken, strict=True)
            ],
            "totalreward": _plain(sum(action.reward for action in task.key_actions)),
            **metadata,
        },
        "taskquery": task.instruction,
        "identity": _identity(task, number),
        "target_objects": list(task.target_objects),
        "related_objects": list(task.related_objects),
        "navigable_objects": list(task.navigable_objects),
        **extra,
    }


def _action_record(action: KeyAction) -> dict[str, Any]:
    return {
        "action": _spelled(action.verb),
        "objectId": action.object_id,
        "objectType": action.object_type,
        "reward": _plain(action.reward),
        "relatedObject": list(action.related_objects),
    }


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


def _identity(task: Task, number: int) -> object:
    return task.extra.get("identity", number)


def _spelled(verb: str) -> str:
    return _SPELLED.get(verb, verb)


def _unknown(model: BaseModel) -> dict[str, Any]:
    return dict(model.model_extra or {})


def _plain(reward: float) -> int | float:
    """Whole rewards as the files write them: 1, not 1.0."""
    return int(reward) if float(reward).is_integer() else reward


def _kind(data: object) -> str:
    kinds = {dict: "an object", list: "a list", str: "a string", type(None): "null"}
    return kinds.get(type(data), "a number or a truth value")


def _write_json(path: Path, data: object) -> None:
    text = json.dumps(data, indent=4, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
