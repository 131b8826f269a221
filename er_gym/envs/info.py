"""What ``reset`` and ``step`` return as ``info``: a documented record, :class:`Info`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypedDict, overload

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.actions import ACTIONS, INDEX, Action, parse
from er_gym.envs.object_view import ObjectView
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import KeyAction, Task

REPEATED = "repeated action"
"""The reason why an episode is over in which the same action came a fourth time in a row."""


class LegalActions(Sequence[Action]):
    """The actions that a mask allows, in the order of :data:`er_gym.envs.actions.ACTIONS`.

    The list is made on demand, so that a step does not wait for it. ``"open Fridge" in legal``, or
    the same with an :class:`~er_gym.envs.actions.Action`, reads one entry of the mask.

    Args:
        mask: (len(ACTIONS),) int8: 1 for each action that is legal.
    """

    def __init__(self, mask: NDArray[np.int8]) -> None:
        self._mask = mask

    def __contains__(self, action: object) -> bool:
        named = parse(action) if isinstance(action, str) else action
        index = INDEX.get(named) if isinstance(named, Action) else None
        return index is not None and bool(self._mask[index])

    def __iter__(self) -> Iterator[Action]:
        return (ACTIONS[k] for k in self._mask.nonzero()[0].tolist())

    def __len__(self) -> int:
        return int(np.count_nonzero(self._mask))

    @overload
    def __getitem__(self, place: int) -> Action: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[Action, ...]: ...
    def __getitem__(self, place: int | slice) -> Action | tuple[Action, ...]:
        return tuple(self)[place]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, LegalActions):
            return NotImplemented
        return np.array_equal(self._mask, other._mask)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"LegalActions({', '.join(map(str, self))})"


class _Always(TypedDict):
    """What every ``info`` has."""

    task: Task
    """The task. It holds the key actions, which an agent should not read."""
    action: Action | None
    """The action; None after ``reset`` and after a reply that names no known action."""
    action_text: str
    """The action as it was given to ``step``; ``""`` after ``reset``."""
    action_success: bool
    """Whether the action was legal and the simulator did it; after ``reset``, whether the simulator
    placed the agent."""
    object_id: str
    """The object that the action was done to, ``""`` for none."""
    feedback: str
    """What the environment tells the agent about the action, a sentence or two."""
    visible: tuple[str, ...]
    """The object types that the agent sees now, in alphabetical order."""
    held: str
    """The type of the object in the agent's hand, ``""`` for none."""
    navigable: tuple[str, ...]
    """Types that the agent may navigate to: clearly visible before, or listed by the task."""
    interactable: tuple[str, ...]
    """Types with an object in reach now, in alphabetical order. ``legal`` has the verbs."""
    legal: LegalActions
    """The actions that are legal now."""
    action_mask: NDArray[np.int8]
    """The legal actions by index, for learners: (len(ACTIONS),) int8, 1 for each."""
    steps: int
    """The number of steps taken; placing the agent is the first."""
    max_steps: int
    """The step limit of this episode; placing the agent counts as the first step."""
    key_actions_done: tuple[KeyAction, ...]
    """The key actions done, in the order in which they were done (:mod:`er_gym.tasks.judge`)."""
    key_actions_left: tuple[KeyAction, ...]
    """The key actions not done yet, in the order of the task."""
    success: bool
    """Whether the task is done; decided at ``end``, False before."""
    goal_unmet: tuple[Condition, ...]
    """The conditions of the task's goal that did not hold at ``end``; empty before."""
    end_reason: str
    """Why the episode is over, ``""`` while it is not: ``"end"``, ``"step limit"``,
    ``"repeated action"`` or ``"no known action"``."""


class Info(_Always, total=False):
    """What ``reset`` and ``step`` return beside the observation."""

    end_appended: bool
    """After ``step``: whether the paper's protocol appended an ``end`` to the episode."""
    fault: str
    """In an environment with faults: the kind of fault that was injected into the action, ``""``
    for none (:mod:`er_gym.envs.faults`). It is for records: an agent should not read it."""
    views: dict[str, NDArray[np.uint8] | None]
    """After ``observe``: the picture of each view by its direction, (height, width, 3) uint8; None
    where none is drawn."""
    object_views: tuple[ObjectView, ...]
    """With the observation ``objects``: the objects in view without the held one and the floor,
    nearest first."""
    object_views_around: dict[str, tuple[ObjectView, ...]]
    """With the observation ``objects``, after ``observe``: the same for each direction."""
    instance_ids: tuple[str, ...]
    """With the observation ``instance``: the object id for each of its numbers, ``""`` for 0 and
    for what is not in the picture."""
