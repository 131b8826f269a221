"""A task for an agent: :class:`Task`, its :class:`KeyAction` list and :class:`AgentPose`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from er_gym.tasks import verbs
from er_gym.tasks.arrangement import Arrangement
from er_gym.tasks.goal import Condition
from er_gym.tasks.types import TaskType

_NUMBER = re.compile(r"[+-]?\d+(\.\d+)?")


def type_of_id(object_id: str) -> str:
    """The object type of an AI2-THOR object id, ``""`` for an empty id.

    The id of a part ends in the part's type, after the coordinates of the whole object:
    ``Sink|-01.90|+00.97|-01.50|SinkBasin`` is a SinkBasin, ``Apple|…|AppleSliced_2`` an
    AppleSliced. Houses have numbers in place of coordinates: ``Apple|surface|2|0``.
    """
    if not object_id:
        return ""
    last = object_id.rsplit("|", 1)[-1]
    if _NUMBER.fullmatch(last):
        return object_id.split("|", 1)[0]
    return re.sub(r"_\d+$", "", last)


def whole_id(object_id: str) -> str:
    """The id of the whole object: its type and its numbers, without the name of a part."""
    fields = object_id.split("|")
    while len(fields) > 2 and not _NUMBER.fullmatch(fields[-1]):
        fields.pop()
    return "|".join(fields)


@dataclass(frozen=True)
class AgentPose:
    """A pose of the agent: metres and degrees, AI2-THOR's world frame.

    Attributes:
        x, y, z: the agent's position; y is the height of its centre, not of its feet.
        rotation: clockwise seen from above; at 0 the agent looks along +z.
        horizon: pitch of the camera; positive is downwards.
        standing: False if the agent crouches.
    """

    x: float
    y: float
    z: float
    rotation: float
    horizon: float = 0.0
    standing: bool = True


@dataclass(frozen=True)
class KeyAction:
    """An action by which a task is judged.

    Attributes:
        verb: canonical (see :mod:`er_gym.tasks.verbs`).
        object_id: the AI2-THOR id of the object, ``""`` for ``end``.
        object_type: the type that the task file states. Real files sometimes leave it empty or
            state another object's type.
        related_objects: ids of other objects that the action involves.
        reward: the reward for doing it.
    """

    verb: str
    object_id: str = ""
    object_type: str = ""
    related_objects: tuple[str, ...] = ()
    reward: float = 1.0

    @property
    def actual_type(self) -> str:
        """The object's type, from its id if it has one."""
        return type_of_id(self.object_id) or self.object_type

    @property
    def scored(self) -> bool:
        """Whether success requires it; navigation and observation are up to the agent."""
        return self.verb not in verbs.UNSCORED


@dataclass(frozen=True)
class Task:
    """An instruction in a scene, and the criteria by which an episode is judged.

    Attributes:
        id: unique in its suite and usable as a file name.
        type: the row of :data:`er_gym.tasks.types.TASK_TYPES`.
        scene: an iTHOR scene name, ``FloorPlan1`` and so on, or the name of a house.
        instruction: the text for the agent.
        key_actions: in the order in which an expert does them.
        name: the instruction before paraphrase (the paper's ``taskname``; its scorer reads it).
        target_objects, related_objects: object ids. If an action names only a type, these objects
            are preferred.
        navigable_objects: object types to which the agent may navigate from the beginning.
        goal: conditions on the final state, besides the key actions; the paper's files have none.
        arrangement: how the scene is arranged when the episode begins.
        poses: object id to the exact pose to which navigation leads, if the file states one.
        extra: fields of the file that er-gym does not use; they are kept for writing.
    """

    id: str
    type: TaskType
    scene: str
    instruction: str
    key_actions: tuple[KeyAction, ...]
    name: str = ""
    target_objects: tuple[str, ...] = ()
    related_objects: tuple[str, ...] = ()
    navigable_objects: tuple[str, ...] = ()
    goal: tuple[Condition, ...] = ()
    arrangement: Arrangement = field(default_factory=Arrangement)
    poses: Mapping[str, AgentPose] = field(default_factory=dict)
    extra: Mapping[str, object] = field(default_factory=dict)

    @property
    def max_steps(self) -> int:
        """The step limit of the task's type; placing the agent counts as the first step."""
        return self.type.max_steps

    @property
    def total_reward(self) -> float:
        """The sum of the key actions' rewards."""
        return sum(action.reward for action in self.key_actions)

    @cached_property
    def named(self) -> frozenset[str]:
        """Ids of the objects that the goal names; elsewhere any object of a type is right."""
        return frozenset(condition.object_id for condition in self.goal) - {""}
