"""A player that crashes in some episodes; a module, for spawned processes to import."""

from __future__ import annotations

import os

from sampled_agents import TASKS

from er_gym.envs.actions import Action
from er_gym.rollout.agent import Decision

CRASHES = "UNSTEADY_CRASHES"
"""The environment variable that names tasks, with commas, whose first sample crashes."""
GIVEN_UP = TASKS[2]
"""This task is given up, the others are done."""


class Unsteady:
    """Does the key actions at once, or gives up, or crashes after the first action."""

    obs_mode = "state"

    def __init__(self, seed=0):
        pass

    def reset(self, task, obs, info):
        name, _, later = task.id.partition(".sample")
        self._crashes = not later and name in os.environ.get(CRASHES, "").split(",")
        keys = [Action(key.verb, key.actual_type) for key in task.key_actions]
        self._plan = iter([Action("observe"), Action("end")] if name == GIVEN_UP else keys)
        self._acted = False

    def act(self, obs, info):
        if self._acted and self._crashes:
            raise RuntimeError("unsteady")
        self._acted = True
        return Decision(next(self._plan))
