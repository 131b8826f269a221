"""A searcher that stumbles: now and then it first tries what is not possible, and then goes on.

A model that imitates a player without mistakes never learns what to do after its own: it tries what
was refused again. Demonstrations into which mistakes are mixed teach that (Laskey et al. 2017,
arXiv 1703.09327). Each mistake is an action that the environment refuses, so it changes nothing but
the steps that are left, and ``er-gym collect --select --keep-failed`` marks it as not to be learnt.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agents.scripted.searcher import SearcherAgent, search_priors
from er_gym.envs.actions import Action
from er_gym.rollout.agent import Decision
from er_gym.tasks import verbs
from er_gym.tasks.task import Task
from er_gym.thor import OBJECT_TYPES

RATE = 0.15
"""The probability of a mistake before an action."""
_AGAIN, _SAME = 0.5, 0.5
"""The probability of another mistake after one, and that it is the same one."""
_MOST = 2
"""Mistakes in a row, at most: the fourth same action in a row would end the episode."""
_ROOM = 6
"""Steps that must be left for a mistake."""
_SHARES = {verbs.NAVIGATE: 0.5, verbs.OPEN: 0.2, verbs.PICKUP: 0.2, verbs.PUT: 0.1}
"""How often each verb is what is tried."""


class StumblerAgent:
    """Plays as :class:`~agents.scripted.searcher.SearcherAgent`, with mistakes before its actions.

    Args:
        seed: of the mistakes.
    """

    obs_mode = SearcherAgent.obs_mode

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)
        self._searcher = SearcherAgent()

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._searcher.reset(task, obs, info)
        self._planned: Decision | None = None
        self._mistakes: list[Action] = []

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """A mistake, or the searcher's action. The searcher decides first: a refused action changes
        nothing that it knows."""
        planned = self._planned or self._searcher.act(obs, info)
        mistake = self._mistake(info)
        if mistake is None:
            self._planned, self._mistakes = None, []
            return planned
        self._planned = planned
        self._mistakes.append(mistake)
        return Decision(mistake)

    def _mistake(self, info: Mapping[str, Any]) -> Action | None:
        """What is tried now although it is not legal; None for nothing."""
        made, draw = len(self._mistakes), self._random
        if made >= _MOST or info["max_steps"] - info["steps"] <= _ROOM + made:
            return None
        if draw.random() >= (_AGAIN if made else RATE):
            return None
        if made and draw.random() < _SAME:
            return self._mistakes[-1]
        verb = str(draw.choice([*_SHARES], p=[*_SHARES.values()]))
        tried = [name for name in _objects(verb, info) if Action(verb, name) not in info["legal"]]
        return Action(verb, str(draw.choice(tried))) if tried else None


def _objects(verb: str, info: Mapping[str, Any]) -> Sequence[str]:
    """The types with which somebody might try a verb, whether that is possible or not."""
    seen = sorted({*info["visible"], *info["navigable"]})
    if verb == verbs.NAVIGATE:  # places of other rooms, or of this one that nobody has seen yet
        return [name for name in OBJECT_TYPES if search_priors.has(name, "receptacle")]
    if verb == verbs.PUT:
        return [name for name in seen if search_priors.has(name, "receptacle")]
    prop = "openable" if verb == verbs.OPEN else "pickupable"
    return [name for name in seen if search_priors.has(name, prop)]
