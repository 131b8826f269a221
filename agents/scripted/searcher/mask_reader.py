"""How far the lists of legal actions carry: an agent that goes through them from A to Z."""

from __future__ import annotations

from collections.abc import Mapping

from agents.scripted.searcher.agent import SearcherAgent
from er_gym.envs.actions import Action
from er_gym.tasks import verbs


class MaskReaderAgent(SearcherAgent):
    """The searcher without knowledge of where things usually are, and without memory of places.

    It reads the instruction and the lists that ``info`` gives every agent. It goes to what the
    instruction names as soon as that is in the list; until then it goes through the list from A to
    Z, each type as often as every other.
    """

    def _best_place(self, thing: str, tried: Mapping[str, int]) -> str:
        """The navigable type that was tried least, the first of these in the alphabet."""
        names = [
            name
            for name in sorted(self._view.navigable)
            if self._repeats < 3 or self._last != Action(verbs.NAVIGATE, name)
        ]
        if thing in names and tried.get(thing, 0) < 3:
            return thing
        return min(names, key=lambda name: tried.get(name, 0), default="")
