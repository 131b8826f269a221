"""An agent that knows the key actions: it shows that tasks can be solved.

It is no upper bound where the environment chooses which object a name means by the agent's way
(``instances="explore"``): there it goes by ids that the environment does not heed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from er_gym.envs.actions import Action
from er_gym.envs.solver import Solver
from er_gym.rollout.agent import Decision
from er_gym.tasks.task import Task


class OracleAgent:
    """Takes the actions of :class:`~er_gym.envs.solver.Solver`."""

    obs_mode = "text"

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._solver = Solver()

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The next step towards the first key action that is not done yet."""
        action, key = self._solver.next(info)
        if key is None:
            return Decision(action, "Everything is done.")
        return Decision(action, f"The next key action is {key.verb} {key.actual_type}.")

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Do nothing: the oracle reads the remaining key actions anew at each step."""
