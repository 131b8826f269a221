"""A course: who decides what to do next in an episode, and why."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from er_gym.data.trajectory import Purpose, Subgoal
from er_gym.envs.actions import Action
from er_gym.envs.info import action_of, detail
from er_gym.tasks.task import KeyAction


@dataclass(frozen=True)
class Intent:
    """A decision and its reason.

    Attributes:
        action, purpose, subgoal, plan: as :class:`~er_gym.data.trajectory.Turn` has them.
        train: whether the turn is to be learnt from.
        checked: how many thoughts of verification precede the decision, see
            :class:`~agents.expert.thought_kinds.ThoughtKinds`.
    """

    action: Action
    purpose: Purpose
    subgoal: Subgoal
    plan: tuple[str, ...] = ()
    train: bool = True
    checked: str = ""


@dataclass(frozen=True)
class View:
    """What a course reads after a step: parts of ``info``, then all of it, and the observation."""

    visible: frozenset[str]
    held: str
    navigable: tuple[str, ...]
    reach: frozenset[str]
    legal: Container[Action]
    action: Action | None
    success: bool
    done: int
    left: tuple[KeyAction, ...]
    steps_left: int
    info: Mapping[str, Any]
    obs: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, obs: Mapping[str, Any], info: Mapping[str, Any]) -> View:
        """Read an observation, and ``info`` with its details."""
        return cls(
            visible=frozenset(detail(info, "visible")),
            held=info["held"],
            navigable=info["navigable"],
            reach=frozenset(info["interactable"]),
            legal=info["legal"],
            action=action_of(info),
            success=info["action_success"],
            done=info["key_actions_done"],
            left=info["keys_left"],
            steps_left=info["max_steps"] - info["steps"],
            info=info,
            obs=obs,
        )


class Course(Protocol):
    """Decides the actions of one episode.

    Attributes:
        view: the environment's last answer; it is set before each decision.
    """

    view: View

    def intents(self) -> Iterator[Intent]:
        """The decisions, one for each step, ``end`` the last; ``view`` is new after each."""
