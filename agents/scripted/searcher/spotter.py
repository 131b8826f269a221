"""A searcher that goes to where it sees a thing, also from afar."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

from agents.scripted.searcher import search_priors
from agents.scripted.searcher.agent import SearcherAgent, Steps
from er_gym.envs.actions import Action
from er_gym.envs.info import detail
from er_gym.envs.object_view import ObjectView, lies_elsewhere, nearest_to
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

_NEIGHBOURS = 2
"""How many types near a thing it goes to, where it cannot go to what holds the thing."""


class SpotterAgent(SearcherAgent):
    """The searcher, but a thing in view that is too far to go to is looked for where it was seen.

    It goes to the type that the thing lies in or on, once for each usual object of this type; or,
    if it cannot go there, to a type near the thing. The searcher goes through the likeliest places
    instead, whatever it sees from afar. And where the instruction says where a thing lies, it does
    not pick one up while it sees it only elsewhere. Beside what the searcher uses, this agent reads
    the objects in view.
    """

    obs_mode = "text+objects"

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode: read the instruction."""
        super().reset(task, obs, info)
        self._seen: dict[str, tuple[ObjectView, Sequence[ObjectView]]] = {}
        self._gone: Counter[tuple[str, str]] = Counter()  # for a thing to a type
        self._ahead: Sequence[ObjectView] = ()
        self._held: set[str] = set()  # all types that it has held
        self._source = ""  # where the thing that it looks for lies, if the instruction says it

    def _take_result(self, info: Mapping[str, Any]) -> None:
        """Note what came of the last action, and what is in view, with what else is."""
        super()._take_result(info)
        for views in (*detail(info, "object_views_around").values(), detail(info, "object_views")):
            for each in reversed(views):  # the nearest of a type in a view comes last and stays
                self._seen[each.object_type] = each, views
        self._seen.pop(info["held"], None)
        self._ahead = detail(info, "object_views")
        self._held.add(info["held"])

    def _reach(self, thing: str, verb: str = "", source: str = "") -> Steps:
        """Search until an object is within reach, of the source if there is one."""
        self._source = source
        return (yield from super()._reach(thing, verb, source))

    def _ready(self, thing: str, verb: str) -> bool:
        """Whether an action is legal; not to pick up what the instruction does not mean."""
        if verb == verbs.PICKUP and self._source and thing not in self._held:
            return super()._ready(thing, verb) and not lies_elsewhere(
                thing, self._source, self._ahead
            )
        return super()._ready(thing, verb)

    def _best_place(self, thing: str, tried: Mapping[str, int]) -> str:
        """Where the thing was seen; else as the searcher."""
        if thing in self._seen and thing not in self._view.navigable:
            for place in self._ways_to(*self._seen[thing]):
                again = self._repeats >= 3 and self._last == Action(verbs.NAVIGATE, place)
                if self._gone[thing, place] < search_priors.usual_number(place) and not again:
                    self._gone[thing, place] += 1
                    return place
        return super()._best_place(thing, tried)

    def _ways_to(self, seen: ObjectView, views: Sequence[ObjectView]) -> Sequence[str]:
        """The types to go to for a thing, the best first."""
        if seen.on in self._view.navigable:
            return (seen.on,)
        near = (name for name in nearest_to(seen, views) if name in self._view.navigable)
        return tuple(islice(near, _NEIGHBOURS))
