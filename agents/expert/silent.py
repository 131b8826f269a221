"""An agent that follows a course without thoughts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from agents.expert.course import Course, Intent, View
from er_gym.rollout.agent import Decision
from er_gym.tasks.task import Task


class SilentAgent:
    """Does what a course decides; for episodes of which only the actions are wanted."""

    obs_mode = "objects"

    def __init__(self, course: Course) -> None:
        self._course = course

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._intents: Iterator[Intent] | None = None

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The course's next action."""
        self._course.view = View.of(info)
        if self._intents is None:
            self._intents = self._course.intents()
        return Decision(next(self._intents).action)
