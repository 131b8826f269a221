"""A player that succeeds now and then; a module, for spawned processes to import."""

from __future__ import annotations

from random import Random

from er_gym.envs.actions import Action
from er_gym.rollout.agent import Decision

TASKS = (
    "FloorPlan14-single_search-SoapBottle",
    "FloorPlan5-single_pickup-Pan",
    "FloorPlan311-pickup_and_put-AlarmClock-Dresser",
)
"""Tasks of the suite mini whose key actions can be done at once."""


class Wavering:
    """Does the key actions, in one of these ways, by its seed: at once; after a look around; after
    something illegal; or not at all, in two ways."""

    obs_mode = "state"

    def __init__(self, seed=0):
        self._seed = seed

    def reset(self, task, obs, info):
        keys = [Action(key.verb, key.actual_type) for key in task.key_actions]
        ways = (
            keys,
            [Action("observe"), *keys],
            [Action("pickup", "Book"), *keys],
            [keys[0], Action("observe"), Action("end")],
            [Action("observe"), Action("end")],
        )
        self._plan = iter(Random(self._seed).choice(ways))

    def act(self, obs, info):
        if not info["fault"]:  # else once more
            self._action = next(self._plan)
        return Decision(self._action)
