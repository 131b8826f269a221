"""How one episode judges which actions are legal, and carries them out.

The environment calls an :class:`ActionHandler`. :class:`DefaultActionHandler` has the rules of the
default protocol (:mod:`er_gym.envs.protocol`). A handler lives for one episode and remembers where
the agent went.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from er_gym.envs import feedback_words, legality, object_selection, skills
from er_gym.envs.actions import Action
from er_gym.envs.legality import AvailableObjects, KnownTypes
from er_gym.envs.perception import Perception
from er_gym.envs.skills import Outcome, Reachable
from er_gym.tasks import verbs
from er_gym.tasks.task import AgentPose, KeyAction, Task

ExecutedAction = tuple[str, Outcome]
"""The id of the object that an action was done to, ``""`` for none; and the outcome."""


@dataclass(frozen=True)
class EpisodeSetup:
    """What an action handler knows when an episode begins.

    Attributes:
        task: the episode's task.
        controller: an AI2-THOR controller whose scene is arranged; the agent is not placed yet.
        floor: the positions where the agent can stand.
        start: the pose in which the agent will be placed.
        grid_size: metres.
        instances: which object a type name stands for, see :mod:`er_gym.envs.object_selection`.
        resumed: whether the episode began earlier; :meth:`ActionHandler.restore` follows.
    """

    task: Task
    controller: Any
    floor: Reachable
    start: AgentPose
    grid_size: float
    instances: str
    resumed: bool = False


@dataclass(frozen=True)
class StepContext:
    """What an action handler knows when the agent acts.

    Attributes:
        perception: what the agent perceives.
        available: the objects that it can navigate to and interact with.
        left: the key actions that are not done yet.
    """

    perception: Perception
    available: AvailableObjects
    left: Sequence[KeyAction]


class ActionHandler(Protocol):
    """How actions are judged and carried out in one episode."""

    @property
    def navigated_to(self) -> str:
        """The id of the object last navigated to, ``""`` at first."""

    def available_objects(self, perception: Perception) -> AvailableObjects:
        """The objects that the agent can navigate to and interact with now."""

    def illegal_reason(self, action: Action, available: AvailableObjects, known: KnownTypes) -> str:
        """Why an action is illegal now, in words for the agent; ``""`` if it is legal."""

    def legal(self, available: AvailableObjects, known: KnownTypes) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for each action that is legal now."""

    def execute(self, action: Action, now: StepContext) -> ExecutedAction:
        """Carry out a legal action."""

    def state(self) -> dict[str, Any]:
        """What it remembers of the episode, as plain data."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Remember what :meth:`state` told."""


class DefaultActionHandler:
    """The rules of the default protocol.

    Args:
        setup: the episode's setup.
    """

    def __init__(self, setup: EpisodeSetup) -> None:
        self.navigated_to = ""
        self._setup = setup
        self._visited: dict[str, list[str]] = {}

    def available_objects(self, perception: Perception) -> AvailableObjects:
        """See :func:`~er_gym.envs.legality.available_objects`."""
        return legality.available_objects(perception, self.navigated_to)

    def illegal_reason(self, action: Action, available: AvailableObjects, known: KnownTypes) -> str:
        """See :func:`~er_gym.envs.legality.illegal_reason`."""
        return legality.illegal_reason(action, available, known)

    def legal(self, available: AvailableObjects, known: KnownTypes) -> NDArray[np.int8]:
        """See :func:`~er_gym.envs.legality.legal_actions`."""
        return legality.legal_actions(available, known)

    def execute(self, action: Action, now: StepContext) -> ExecutedAction:
        """Carry out a legal action by the skills of :mod:`er_gym.envs.skills`."""
        setup, objects = self._setup, now.perception.objects
        if action.verb == verbs.OBSERVE:
            return "", skills.observe(setup.controller)
        if action.verb == verbs.MOVE_FORWARD:
            return "", skills.move_forward(setup.controller, setup.grid_size)
        if action.verb == verbs.END:
            return "", Outcome(None, True)
        if action.verb in verbs.BARE_VERBS:
            return "", skills.act_without_object(setup.controller, action.verb)
        if action.verb == verbs.NAVIGATE:
            return self._navigate(action.object_type, now)
        able = legality.candidate_rows(action, now.available)
        if setup.instances == object_selection.TARGET:
            chosen = object_selection.select_for_task(
                setup.task, now.left, action.verb, able, objects
            )
        else:
            chosen = object_selection.select_nearest(able, objects, now.perception.pose)
        done = skills.interact(setup.controller, action.verb, objects, chosen)
        return objects.ids[chosen], done

    def state(self) -> dict[str, Any]:
        """Where the agent went."""
        return {"navigated_to": self.navigated_to, "visited": self._visited}

    def restore(self, state: Mapping[str, Any]) -> None:
        """See :meth:`state`."""
        self.navigated_to = state["navigated_to"]
        self._visited = {name: list(ids) for name, ids in state["visited"].items()}

    def _navigate(self, object_type: str, now: StepContext) -> ExecutedAction:
        setup, perception = self._setup, now.perception
        objects = perception.objects
        able = objects.of_type(object_type)
        if not able:
            return "", Outcome(None, False, feedback_words.GONE(thing=object_type))
        if setup.instances == object_selection.TARGET:
            goal = object_selection.select_for_task(
                setup.task, now.left, verbs.NAVIGATE, able, objects
            )
            aim = object_selection.navigation_target(setup.task, goal, objects)
        else:
            visited = self._visited.setdefault(object_type, [])
            if len(visited) >= len(able):
                visited.clear()
            aim = goal = object_selection.select_nearest(able, objects, perception.pose, visited)
            visited.append(objects.ids[goal])
        goal_id = objects.ids[goal]
        pose = setup.task.poses.get(goal_id)
        if pose is not None:
            # AI2-THOR's agent stood there, so there is room even if our boxes say otherwise.
            outcome = skills.place(setup.controller, pose, force=True)
        else:
            container = object_selection.closed_container_of(aim, objects)
            aim = aim if container is None else container
            outcome = skills.navigate(setup.controller, perception, aim, setup.floor)
        if outcome.success:
            self.navigated_to = goal_id
        return goal_id, outcome
