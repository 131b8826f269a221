"""What ``reset`` and ``step`` return as ``info``, and what the environment offers beside it.

:class:`Info` is plain data with the same keys and types, from ``reset`` to the last step. So
Gymnasium's wrappers, vector environments and data sets can store it. :class:`Details` has the rest:
er-gym's own objects, lists whose length changes, pictures. ``env.unwrapped.details`` returns it,
and :func:`with_details` joins both for the agents that need it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypedDict, overload

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.actions import ACTIONS, INDEX, Action, parse
from er_gym.envs.object_view import ObjectView
from er_gym.envs.perception import type_names
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


class Info(TypedDict):
    """What ``reset`` and ``step`` return beside the observation.

    It always has all of these entries. Each is a bool, an int, a str, or an array of one shape. T
    is the number of :data:`er_gym.thor.OBJECT_TYPES`; :func:`names` lists the types of a (T,)
    array. Observations of other packages may add entries of their own.
    """

    task_id: str
    """The task's id. ``env.unwrapped.task`` is the task."""
    task_type: str
    """The name of the task's type, of :data:`er_gym.tasks.types.TASK_TYPES`."""
    instruction: str
    """What the agent is asked to do."""
    action: str
    """The action, ``navigate to Fridge``; ``""`` after ``reset`` and after a reply that names no
    known action. :func:`action_of` gives the :class:`~er_gym.envs.actions.Action`."""
    verb: str
    """The action's verb, ``""`` for none."""
    object_type: str
    """The object type that the action names, ``""`` for none."""
    action_text: str
    """The action as it was given to ``step``; ``""`` after ``reset``."""
    action_success: bool
    """Whether the action was legal and the simulator did it; after ``reset``, whether the simulator
    placed the agent."""
    object_id: str
    """The object that the action was done to, ``""`` for none."""
    feedback: str
    """What the environment tells the agent about the action, a sentence or two: in English, with
    types and plain words (:func:`er_gym.envs.feedback.told_in` has it in other languages)."""
    error_message: str
    """AI2-THOR's own message on an action that it refused, ``""`` for none. It names objects by ids
    and states positions. It is for records: an agent should not read it."""
    held: str
    """The type of the object in the agent's hand, ``""`` for none."""
    visible_mask: NDArray[np.int8]
    """The object types that the agent sees now: (T,) int8, 1 for each."""
    navigable_mask: NDArray[np.int8]
    """Types that the agent may navigate to: clearly visible before, or listed by the task."""
    interactable_mask: NDArray[np.int8]
    """Types with an object in reach now. ``action_mask`` has the verbs."""
    action_mask: NDArray[np.int8]
    """The legal actions by index: (len(ACTIONS),) int8, 1 for each."""
    steps: int
    """The number of steps taken; placing the agent is the first."""
    max_steps: int
    """The step limit of this episode; placing the agent counts as the first step."""
    key_actions_done: int
    """The number of key actions done (:mod:`er_gym.tasks.judge`)."""
    key_actions_left: int
    """The number of key actions not done yet."""
    success: bool
    """Whether the task is done; decided at ``end``, False before."""
    goal_unmet: str
    """The conditions of the task's goal that did not hold at ``end``, in words, ``"; "`` between
    them; ``""`` before."""
    end_reason: str
    """Why the episode is over, ``""`` while it is not: ``"end"``, ``"step limit"``,
    ``"repeated action"`` or ``"no known action"``."""
    end_appended: bool
    """Whether the paper's protocol has appended an ``end`` to the episode."""
    fault: str
    """In an environment with faults: the kind of fault that was injected into the action, ``""``
    for none (:mod:`er_gym.envs.faults`). It is for records: an agent should not read it."""


class Details(TypedDict):
    """What the environment offers beside ``info`` at each step: ``env.unwrapped.details``.

    No key is one of :class:`Info`, so both can be joined (:func:`with_details`).
    """

    task: Task
    """The task. It holds the key actions, which an agent should not read."""
    keys_done: tuple[KeyAction, ...]
    """The key actions done, in the order in which they were done."""
    keys_left: tuple[KeyAction, ...]
    """The key actions not done yet, in the order of the task."""
    unmet: tuple[Condition, ...]
    """The conditions of the task's goal that did not hold at ``end``; empty before."""
    side_effects: tuple[str, ...]
    """After the last step: what the agent changed in the room that the task did not ask for, such
    as ``"opened Fridge|-02.10|+00.00|+01.07"`` (:mod:`er_gym.tasks.side_effects`); empty before."""
    visible: tuple[str, ...]
    """The names of the types in ``visible_mask``, in alphabetical order."""
    navigable: tuple[str, ...]
    """The names of the types in ``navigable_mask``, in alphabetical order, and those that the task
    lists although no scene has them."""
    interactable: tuple[str, ...]
    """The names of the types in ``interactable_mask``, in alphabetical order."""
    legal: LegalActions
    """The actions in ``action_mask``."""
    views: dict[str, NDArray[np.uint8] | None]
    """After ``observe``: the picture of each view by its direction, (height, width, 3) uint8; None
    where none is drawn. Empty after other actions."""
    object_views: tuple[ObjectView, ...]
    """With the observation ``objects``: the objects in view without the held one and the floor,
    nearest first. Empty without it."""
    object_views_around: dict[str, tuple[ObjectView, ...]]
    """With the observation ``objects``, after ``observe``: the same for each direction."""
    instance_ids: tuple[str, ...]
    """With the observation ``instance``: the object id for each of its numbers, ``""`` for 0 and
    for what is not in the picture. Empty without it."""


def names(mask: NDArray[np.int8]) -> tuple[str, ...]:
    """The names of the object types in a mask of :class:`Info`, in alphabetical order.

    Args:
        mask: (T,), not 0 for each type.
    """
    return type_names(mask.astype(bool))


def action_of(info: Mapping[str, Any]) -> Action | None:
    """The action of the last step; None after ``reset`` and after a reply that names none."""
    return Action(info["verb"], info["object_type"]) if info["verb"] else None


def with_details(env: Any, info: Mapping[str, Any]) -> dict[str, Any]:
    """``info`` together with :class:`Details`, as er-gym's agents get it.

    Args:
        env: the environment that has just returned ``info``, wrapped or not.

    Raises:
        ValueError: it is none of er-gym's.
    """
    details = getattr(env.unwrapped, "details", None)
    if not isinstance(details, Mapping):
        raise ValueError(
            f"{type(env.unwrapped).__name__} has no details; give an er-gym environment, such as "
            "gymnasium.make('ER-SinglePickup-v0')"
        )
    return {**info, **details}


def detail(info: Mapping[str, Any], name: str) -> Any:
    """An entry of :class:`Details` in the ``info`` that an agent was given.

    Raises:
        ValueError: the agent was given the environment's ``info`` alone.
    """
    if name not in info:
        raise ValueError(
            f"this agent needs {name!r}, which the environment's info does not hold; give it "
            "er_gym.envs.info.with_details(env, info) in place of info"
        )
    return info[name]
