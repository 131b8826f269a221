"""The records of the paper's two task formats, and the fields that one side lacks.

``Task.extra`` keeps the fields for which :class:`~er_gym.tasks.task.Task` has no attribute:

- ``task_metadata``: the fields that the paper's generator wrote, without its list of actions;
- ``actions``: a mapping for each key action, with the fields that
  :class:`~er_gym.tasks.task.KeyAction` lacks.

:class:`OwnFields`, under the key ``er_gym``, keeps the attributes for which the paper's records
have no field. The paper's own files have no such key. They do not get one when er-gym reads them
and writes them again.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, astuple, replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict

from er_gym.tasks import verbs
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import as_utf8, known_scene, known_type, known_verb
from er_gym.tasks.jsonl_format import ConditionRecord, PoseRecord
from er_gym.tasks.reading import parse_json, read_text
from er_gym.tasks.task import AgentPose, KeyAction, Task

_SPELLED = {verbs.PUT: "put"}
"""Verbs that the paper's task files and its agents' replies spell differently."""
_KINDS = {dict: "an object", list: "a list", str: "a string", type(None): "null"}
Kind = TypeVar("Kind", list[Any], dict[str, Any])


class OwnFields(BaseModel):
    """The attributes of a task that the paper's fields do not state.

    Each attribute overrides the paper's fields. If it is left out, the paper's fields decide.

    Attributes:
        id: also stated where ``extra`` differs from what the paper's fields give. A task that
            states its id takes ``extra`` from here alone.
        layout_poses: object name to x, y, z (metres) and pitch, yaw, roll (degrees).
        poses: object id to the agent's pose; test files have a pose file for these.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    id: str | None = None
    type: str | None = None
    scene: str | None = None
    instruction: str | None = None
    name: str | None = None
    target_objects: tuple[str, ...] = ()
    related_objects: tuple[str, ...] = ()
    navigable_objects: tuple[str, ...] = ()
    goal: tuple[ConditionRecord, ...] = ()
    layout: str = ""
    layout_poses: dict[str, tuple[float, float, float, float, float, float]] = {}
    dirty: tuple[str, ...] = ()
    poses: dict[str, PoseRecord] = {}
    extra: dict[str, Any] = {}


_SHARED_FIELDS = (
    "id", "instruction", "name", "target_objects", "related_objects", "navigable_objects",
)  # fmt: skip
"""Fields that :class:`OwnFields` and tasks have in the same form."""


class _PaperModel(BaseModel):
    """Keeps unknown fields, so that they can be written again."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=False)


class PaperAction(_PaperModel):
    """A key action as the paper's files write it."""

    action: str
    objectId: str
    objectType: str
    relatedObject: list[str] = []
    reward: int | float = 1


class PaperMetadata(_PaperModel):
    """The part of a test file that repeats the record of the paper's generator."""

    actions: list[PaperAction]


class PaperGeneratedTask(PaperMetadata):
    """A task as the paper's generator writes it."""

    taskname: str
    tasktype: str
    metadatapath: str = ""
    er_gym: OwnFields = OwnFields()


class PaperTask(_PaperModel):
    """A task as the paper's test file writes it."""

    scene: str
    tasktype: str
    taskname: str
    task_metadata: PaperMetadata
    taskquery: str | None = None
    identity: int | str
    target_objects: list[str] = []
    related_objects: list[str] = []
    navigable_objects: list[str] = []
    er_gym: OwnFields = OwnFields()


def key_actions(actions: list[PaperAction], where: str) -> tuple[KeyAction, ...]:
    """The key actions of the paper's records.

    Raises:
        TaskFileError: a verb is unknown; the message begins with ``where``.
    """
    return tuple(
        KeyAction(
            verb=known_verb(action.action, where),
            object_id=action.objectId,
            object_type=action.objectType,
            related_objects=tuple(action.relatedObject),
            reward=action.reward,
        )
        for action in actions
    )


def extra_action_fields(action: PaperAction) -> dict[str, Any]:
    """The fields that :class:`KeyAction` lacks, among them an unusual spelling of the verb."""
    usual = action.action == _spelled(verbs.canonical_verb(action.action))
    return extra_fields(action) | ({} if usual else {"action": action.action})


def extra_fields(model: BaseModel) -> dict[str, Any]:
    """The fields of a record that its model does not declare."""
    return dict(model.model_extra or {})


def metadata_record(task: Task) -> dict[str, Any]:
    """A task as the paper's generator writes it, without the path of the scene's metadata."""
    metadata = task.extra.get("task_metadata")
    return {
        "taskname": task.name,
        "tasktype": task.type.name,
        "actions": _action_records(task),
        "totalreward": _plain(task.total_reward),
        **without_fields_of(metadata, PaperMetadata),
    }


def without_fields_of(fields: object, model: type[BaseModel]) -> dict[str, Any]:
    """The fields that a model does not declare; empty if ``fields`` is not a mapping."""
    if not isinstance(fields, Mapping):
        return {}
    return {name: value for name, value in fields.items() if name not in model.model_fields}


def own_fields(task: Task, plain: Task) -> dict[str, Any]:
    """:class:`OwnFields` of a task under their key ``er_gym``; empty if there are none to state.

    Args:
        task: the task that is written.
        plain: the task that the paper's fields alone give when they are read.
    """
    own: dict[str, Any] = {
        name: getattr(task, name)
        for name in (*_SHARED_FIELDS, "scene")
        if getattr(task, name) != getattr(plain, name)
    }
    if task.type != plain.type:
        own["type"] = task.type.name
    if "id" in own or task.extra != plain.extra:
        own |= {"id": task.id, "extra": dict(task.extra)}
    record = OwnFields(
        **own,
        goal=tuple(map(ConditionRecord.of, task.goal)),
        layout=task.arrangement.layout,
        layout_poses={name: astuple(pose) for name, pose in task.arrangement.poses.items()},
        dirty=task.arrangement.dirty,
        poses={key: PoseRecord(**asdict(pose)) for key, pose in task.poses.items()},
    )
    fields = record.model_dump(exclude_defaults=True)
    return {"er_gym": fields} if fields else {}


def with_own_fields(plain: Task, own: OwnFields, where: str) -> Task:
    """The task that ``plain``, from the paper's fields, and :class:`OwnFields` give together."""
    defaults = OwnFields()
    stated = {
        name: getattr(own, name)
        for name in _SHARED_FIELDS
        if getattr(own, name) != getattr(defaults, name)
    }
    return replace(
        plain,
        type=plain.type if own.type is None else known_type(own.type, where),
        scene=plain.scene if own.scene is None else known_scene(own.scene, where),
        goal=tuple(condition.condition() for condition in own.goal),
        arrangement=Arrangement(
            own.layout,
            {name: ObjectPose(*pose) for name, pose in own.layout_poses.items()},
            own.dirty,
        ),
        poses={key: AgentPose(**dict(pose)) for key, pose in own.poses.items()},
        extra=plain.extra if own.id is None and not own.extra else own.extra,
        **stated,
    )


def read_json(path: Path, kind: type[Kind], of: str, example: str) -> Kind:
    """Read a JSON file of the paper.

    Args:
        path: the file.
        kind: list or dict.
        of: what it holds, for messages.
        example: a sentence that shows such a file, for messages.

    Raises:
        TaskFileError: the file cannot be read, or holds another kind of value.
    """
    data = parse_json(read_text(path), path)
    if isinstance(data, kind):
        return data
    found = _KINDS.get(type(data), "a number or a truth value")
    raise TaskFileError(f"{path}: not {_KINDS[kind]} of {of} but {found}; {example}")


def as_json(path: Path, data: object) -> bytes:
    """The content of a JSON file in the paper's layout, UTF-8.

    Raises:
        TaskFileError: a text holds a lone surrogate.
    """
    return as_utf8(json.dumps(data, indent=4, ensure_ascii=False) + "\n", path)


def odd_spellings(task: Task) -> list[str]:
    """For each key action, the verb as the task's file spells it; "" for the usual spelling."""
    spelled = (
        _as_spelled(action.verb, more)
        for action, more in zip(task.key_actions, _extra_of_actions(task), strict=True)
    )
    usual = (_spelled(action.verb) for action in task.key_actions)
    return ["" if one == other else one for one, other in zip(spelled, usual, strict=True)]


def _extra_of_actions(task: Task) -> Sequence[object]:
    """For each key action, the fields of the task's file that :class:`KeyAction` lacks."""
    rest = task.extra.get("actions")
    if not isinstance(rest, list) or len(rest) != len(task.key_actions):
        return [{}] * len(task.key_actions)
    return rest


def _action_records(task: Task) -> list[dict[str, Any]]:
    return [
        {
            "action": _as_spelled(action.verb, more),
            "objectId": action.object_id,
            "objectType": action.object_type,
            "reward": _plain(action.reward),
            "relatedObject": list(action.related_objects),
            **without_fields_of(more, PaperAction),
        }
        for action, more in zip(task.key_actions, _extra_of_actions(task), strict=True)
    ]


def _as_spelled(verb: str, more: object) -> str:
    """The verb as the task's file spelled it; the usual spelling if the verb has changed since."""
    odd = more.get("action") if isinstance(more, Mapping) else None
    return odd if isinstance(odd, str) and verbs.canonical_verb(odd) == verb else _spelled(verb)


def _spelled(verb: str) -> str:
    return _SPELLED.get(verb, verb)


def _plain(reward: float) -> int | float:
    """Whole rewards as the files write them: 1, not 1.0."""
    return int(reward) if float(reward).is_integer() else reward
