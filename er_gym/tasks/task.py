"""What is asked of an agent: :class:`Task` and its :class:`KeyAction` list."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from er_gym.tasks import verbs
from er_gym.tasks.arrangement import Arrangement
from er_gym.tasks.goal import Condition
from er_gym.tasks.types import TaskType

_COORDINATE = re.compile(r"[+-]?\d+\.\d+")


def type_of_id(object_id: str) -> str:
    """The object type that an AI2-THOR object id names, ``""`` for an empty id.

    A part of an object carries its own type behind the coordinates of the whole:
    ``Sink|-01.90|+00.97|-01.50|SinkBasin`` is a SinkBasin, ``Apple|…|AppleSliced_2`` an
    AppleSliced.
    """
    if not object_id:
        return ""
    last = object_id.rsplit("|", 1)[-1]
    if _COORDINATE.fullmatch(last):
        return object_id.split("|", 1)[0]
    return re.sub(r"_\d+$", "", last)


@dataclass(frozen=True)
class AgentPose:
    """Where the agent stands and looks: metres and degrees, AI2-THOR's world frame.

    Attributes:
        x, y, z: the agent's position; y is the height of its centre, not of its feet.
        rotation: clockwise seen from above, 0 looks along +z.
        horizon: downwards is positive.
        standing: False when it crouches.
    """

    x: float
    y: float
    z: float
    rotation: float
    horizon: float = 0.0
    standing: bool = True


@dataclass(frozen=True)
class KeyAction:
    """One of the actions that a task is judged by.

    Attributes:
        verb: canonical (see :mod:`er_gym.tasks.verbs`).
        object_id: the AI2-THOR id of the object it is done to, ``""`` for ``end``.
        object_type: the type that the task file states. Real files are wrong now and then: empty,
            or another object's.
        related_objects: ids of what the action involves besides.
        reward: what doing it is worth.
    """

    verb: str
    object_id: str = ""
    object_type: str = ""
    related_objects: tuple[str, ...] = ()
    reward: float = 1.0

    @property
    def actual_type(self) -> str:
        """The object's type, read from its id where there is one."""
        return type_of_id(self.object_id) or self.object_type

    @property
    def scored(self) -> bool:
        """Whether success asks for it; getting about and looking are the agent's own affair."""
        return self.verb not in verbs.UNSCORED


@dataclass(frozen=True)
class Task:
    """An instruction in a scene, and how it is judged.

    Attributes:
        id: unique in its suite and usable as a file name.
        type: the row of :data:`er_gym.tasks.types.TASK_TYPES`.
        scene: an iTHOR scene name, ``FloorPlan1`` and so on.
        instruction: what the agent is told.
        name: the instruction as generated, before paraphrase (the paper's ``taskname``; its scorer
            looks into it).
        key_actions: in the order in which an expert does them.
        target_objects, related_objects: object ids; names stand for these first.
        navigable_objects: object types that may be navigated to from the start.
        goal: how things must be in the end, beside the key actions; the paper's files say nothing
            of it.
        start: how the scene is arranged when the episode begins.
        poses: object id to the exact pose that going to it leads to, where the file states one.
        extra: fields of the file that nothing here reads, kept so that it can be written again.
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
        """The step limit of the task's type, the first step being the placing of the agent."""
        return self.type.max_steps

    @property
    def total_reward(self) -> float:
        """What all key actions together are worth."""
        return sum(action.reward for action in self.key_actions)

    @cached_property
    def named(self) -> frozenset[str]:
        """Ids of the objects that the words single out; elsewhere any object of a type will do."""
        return frozenset(condition.object_id for condition in self.goal) - {""}
