"""An explorer's course: it does not know where objects are, and searches likely places."""

from __future__ import annotations

from random import Random

from pydantic import BaseModel, ConfigDict, Field

from agents.expert.course import Intent
from agents.expert.legs import Leg
from agents.expert.memory import Sighting
from agents.expert.places import draw_places, likely_places
from agents.expert.task_course import GiveUp, Intents, TaskCourse
from agents.expert.thought_kinds import Check
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import KeyAction, Task

_SHOWN = 2
"""How many places a plan names."""
_LOOKS = 2
"""How often an explorer looks around in one search."""
_LOSES_HEART = 0.5
"""The share of careless explorers that end the episode after a place that does not fit."""


class Strength(BaseModel):
    """How well an explorer plays.

    Attributes:
        share: of the trajectories that explorers of this strength play.
        temperature: 0 goes to the likeliest place first; larger is more random.
        forgets: the share of places visited that it may visit again.
        blunders: the probability of a mistake at each search and action: it goes to an unlikely
            place, takes another object, forgets to open a container, or ends too early.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    share: float = Field(default=1.0, ge=0, allow_inf_nan=False)
    temperature: float = Field(default=1.0, ge=0, allow_inf_nan=False)
    forgets: float = Field(default=0.0, ge=0, le=1)
    blunders: float = Field(default=0.0, ge=0, le=1)


class ExplorerCourse(TaskCourse):
    """Searches places by their likelihood until the object is in view.

    What it has seen it goes back to. It knows the goal of the task, but not where objects are.

    Args:
        task: the task.
        strength: how well it plays.
        random: draws places and mistakes.
        check: how the task ends.
        must_search: whether the episode ends at once if the first thing to be searched for is in
            view from the beginning, since nothing is explored then.
    """

    def __init__(
        self,
        task: Task,
        strength: Strength,
        random: Random,
        check: Check = "",
        *,
        must_search: bool = False,
    ) -> None:
        super().__init__(task, random, check=check)
        self._strength, self._must_search = strength, must_search

    def _find(self, leg: Leg) -> Intents:
        tried: list[str] = []
        looks = 0
        if leg.hidden and self._must_search and self._memory.of(leg.thing):
            raise GiveUp
        self._must_search = self._must_search and not leg.hidden
        if self._random.random() < self._strength.blunders:
            yield from self._stray(leg)
        while True:
            if self._ready(leg):
                return True
            seen = self._memory.of(leg.thing if leg.hidden else leg.place)
            near = self._way_to(leg, seen, tried)
            if near:
                tried.append(near)
                if (yield from self._approach(near, leg)):
                    return True
                continue
            if seen:
                raise GiveUp  # it knows where to look, but cannot get there
            places = self._next_places(leg, tried)
            if not places or (len(tried) >= 3 and looks == 0):
                if looks >= _LOOKS:
                    raise GiveUp
                looks += 1
                yield from self._look_around()
                continue
            if self._random.random() >= self._strength.forgets:
                tried.append(places[0])
            yield from self._visit(places[0], leg, tuple(places))

    def _stray(self, leg: Leg) -> Intents:
        """Go to an unlikely place, and with some probability give up the episode there."""
        weighted = [(place, 1.0) for place, _ in likely_places(leg.thing, self.view.navigable)]
        for place in draw_places(weighted, 1, self._random):
            yield from self._visit(place, leg, (place,))
        if not leg.actions or self._random.random() < _LOSES_HEART:
            raise GiveUp
        return False

    def _approach(self, near: str, leg: Leg) -> Intents:
        carries = self.view.held and not leg.hidden and same_type(near, leg.place)
        yield from self._go(near, "carry" if carries else "approach")
        if not self._ready(leg):
            yield from self._look_inside(near, leg)
        return self._ready(leg)

    def _ready(self, leg: Leg) -> bool:
        """Whether the leg's first key action can be done, or its object is within reach."""
        left = [leg.actions[index] for index in self._left(leg)]
        if not left:
            return self._within_reach(leg.thing)
        first = left[0]
        if first.verb == verbs.OPEN and leg.hidden:
            # The explorer has opened the container itself when it looked inside.
            return any(self._legal(key) is not None for key in left[1:2])
        return self._legal(first) is not None

    def _way_to(self, leg: Leg, seen: Sighting | None, tried: list[str]) -> str:
        """Where to go, and has not gone yet, for what is named, or is or was in view."""
        named = "" if leg.hidden else self._known(leg.place)
        ways = [named] if named else self._ways(seen) if seen else []
        return next((name for name in ways if name not in tried), "")

    def _next_places(self, leg: Leg, tried: list[str]) -> list[str]:
        weighted = likely_places(leg.thing, self.view.navigable, without=tried)
        return draw_places(weighted, _SHOWN, self._random, self._strength.temperature)

    def _do_key(self, key: KeyAction, leg: Leg) -> Intents:
        seen = self._memory.of(leg.thing) if leg.hidden and key.verb == verbs.OPEN else None
        if seen is not None and not seen.fits(key.actual_type):
            raise GiveUp  # what it looks for lies elsewhere
        if self._random.random() < self._strength.blunders:
            yield from self._blunder(key, leg)
        return (yield from super()._do_key(key, leg))

    def _blunder(self, key: KeyAction, leg: Leg) -> Intents:
        """Do something wrong that a careless player does."""
        if key.verb == verbs.PICKUP:
            others = [
                name
                for name in sorted(self.view.reach)
                if name != key.actual_type and Action(verbs.PICKUP, name) in self.view.legal
            ]
            if others:
                wrong = Action(verbs.PICKUP, self._random.choice(others))
                return (yield from self._do(Intent(wrong, "take", self._subgoal)))
        if key.verb == verbs.OPEN and self.view.held:
            early = Action(verbs.PUT, key.actual_type)
            return (yield from self._do(Intent(early, "put", self._subgoal)))
        if key.verb in (verbs.PUT, verbs.TOGGLE, verbs.CLOSE):
            raise GiveUp  # it takes the task for done
        return False
