"""Which actions would show the thing that a policy looks for: they are tried, by branching.

A search that has gone on for long seldom tells by its reward what it should have done: what would
show the thing is one of some thirty actions, and a policy that never closes a drawer never finds
out. In training the environment can tell: it goes on from a copy of the episode with each legal one
that may show something, as to go somewhere, to open and to close do.
The policy learns how likely each is to show the thing, given what it has observed. What it is told
is no part of its observation.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.rl.guidance import Hints
from agents.rl.subtask_memory import SubtaskMemory
from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF

SHOWS = 2
"""In a mask of actions: one that is legal, and would show the thing."""
_LOOKS = {verbs.NAVIGATE, verbs.OPEN, verbs.CLOSE, verbs.OBSERVE, verbs.MOVE_FORWARD}
_IS_LOOK = np.array([action.verb in _LOOKS for action in ACTIONS])


class HintFinder:
    """Tries what would show the thing.

    Args:
        settings: in which states.
        env: for trying; it has the arguments of the environments whose snapshots it gets, and
            observes as little as possible.
    """

    def __init__(self, settings: Hints, env: EmbodiedEnv) -> None:
        self._settings, self._env = settings, env

    def wanted(self, memory: SubtaskMemory, info: Mapping[str, Any], draw: float) -> int | None:
        """The thing for which it is to be tried in a state; None if it is not.

        Args:
            memory: of the search.
            info: what the environment returned.
            draw: a random number from 0 to 1.

        Returns:
            The index of the type that the agent looks for and has not yet seen clearly.
        """
        now = memory.progress.at()
        if now is None or memory.since < self._settings.after or draw >= self._settings.share:
            return None
        kind = KIND_OF.get(now.sought)
        if kind is None or info["end_reason"] or _is_seen(kind, info):
            return None
        return kind

    def showing(self, snapshot: bytes, mask: NDArray[np.int8], kind: int) -> NDArray[np.int8]:
        """Which actions would let the agent see a thing so clearly that it can go there.

        Args:
            snapshot: of the episode.
            mask: (A,), not 0 for the actions to choose from.
            kind: the thing's type.

        Returns:
            (A,) the mask, with :data:`SHOWS` for those actions.
        """
        found = mask.copy()
        for action in np.flatnonzero((mask > 0) & _IS_LOOK).tolist():
            self._env.restore(snapshot)
            if _is_seen(kind, self._env.step(action)[4]):
                found[action] = SHOWS
        return found


def _is_seen(kind: int, info: Mapping[str, Any]) -> bool:
    return bool(info["navigable_mask"][kind] or info["interactable_mask"][kind])
