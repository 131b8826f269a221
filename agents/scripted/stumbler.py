"""A searcher that stumbles: now and then it first tries what is not possible, and then goes on.

A model that imitates a player without mistakes never learns what to do after its own: it tries what
was refused again. Demonstrations into which mistakes are mixed teach that (Laskey et al. 2017,
arXiv 1703.09327). Each mistake is an action that the environment refuses, so it changes nothing but
the steps that are left, and ``er-gym collect --select --keep-failed`` marks it as not to be learnt.

The mistakes are those of somebody who wants the right thing: going straight to what the instruction
names or to a likely place that nobody has seen, taking it from afar, putting it into what is shut.
After mistakes at random a model would learn to try again what it had wanted in the first place.
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

RATE = 0.2
"""The probability of a mistake before an action."""
_AGAIN, _SAME = 0.4, 0.5
"""The probability of another mistake after one, and that it is the same one."""
_ANY = 0.05
"""The likelihood of a place that is none for what is wanted."""
_MOST = 2
"""Mistakes in a row, at most: the fourth same action in a row would end the episode."""
_ROOM = 6
"""Steps that must be left for a mistake."""
_SHARES = {verbs.NAVIGATE: 0.5, verbs.OPEN: 0.2, verbs.PICKUP: 0.2, verbs.PUT: 0.1}
"""How often each verb is what is tried."""
_NAMED = 0.6
"""The probability that it is tried on what the instruction names, where that is refused."""


_RECEPTACLES = tuple(name for name in OBJECT_TYPES if search_priors.has(name, "receptacle"))


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
        goals = self._searcher.goals
        self._things = sorted({goal.object_type for goal in goals})
        self._targets = sorted({goal.target for goal in goals if goal.target})
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
        named, others = (
            [name for name in names if Action(verb, name) not in info["legal"]]
            for names in self._tried(verb, info)
        )
        if not named and not others:
            return None
        if named and (not others or draw.random() < _NAMED):
            return Action(verb, str(draw.choice(named)))
        likely = np.array([self._likelihood(name) for name in others])
        return Action(verb, str(draw.choice(others, p=likely / likely.sum())))

    def _tried(self, verb: str, info: Mapping[str, Any]) -> tuple[Sequence[str], Sequence[str]]:
        """The types with which somebody might try a verb, whether that is possible or not: those
        that the instruction names, and others."""
        seen = sorted({*info["visible"], *info["navigable"]})
        if verb == verbs.NAVIGATE:  # places of other rooms, or of this one that nobody has seen yet
            return [*self._things, *self._targets], _RECEPTACLES
        if verb == verbs.PUT:
            return self._targets, [name for name in seen if name in _RECEPTACLES]
        if verb == verbs.OPEN:
            named = [name for name in self._targets if search_priors.has(name, "openable")]
            return named, [name for name in seen if search_priors.has(name, "openable")]
        named = [name for name in self._things if search_priors.has(name, "pickupable")]
        return named, [name for name in seen if search_priors.has(name, "pickupable")]

    def _likelihood(self, place: str) -> float:
        """How likely somebody takes a type for the place of what the instruction names."""
        likely = (search_priors.likelihood(thing, place) for thing in self._things)
        return _ANY + max(likely, default=0.0)
