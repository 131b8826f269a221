"""What all scripted courses share: they do a task's legs one after the other."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from random import Random
from typing import TypeAlias

from agents.expert.course import Intent
from agents.expert.legs import Leg, keys_left, legs_of, purpose_of
from agents.expert.memory import Remembering, Sighting
from agents.expert.thought_kinds import Check
from agents.scripted.searcher import search_priors
from er_gym.data.trajectory import Purpose, Subgoal
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF, same_type
from er_gym.tasks.task import KeyAction, Task
from er_gym.tasks.types import TRANSPORT

Intents: TypeAlias = Generator[Intent, None, bool]
"""Yields decisions and returns whether their aim was reached."""
_RESERVE = 1
"""Steps kept for ``end``."""
_WAYS = 3
"""So many ways to something that was seen are tried."""
_TRIES = 5
"""An action that is out of reach is given up after this many tries to get closer."""


class GiveUp(Exception):
    """The course cannot be finished as planned; the episode ends."""


class TaskCourse(Remembering):
    """Goes to the place of each leg and does its key actions; subclasses find the places.

    Args:
        task: the task.
        random: makes all random choices.
        check: how the task ends.
        retries: how often a failed action is tried again.
        repeats: the share of successful actions that are repeated without need.
        strict: whether the course is given up when it needs more than the key actions.
    """

    def __init__(
        self,
        task: Task,
        random: Random,
        *,
        check: Check = "",
        retries: int = 0,
        repeats: float = 0.0,
        strict: bool = False,
    ) -> None:
        super().__init__()
        self._task, self._random, self._check = task, random, check
        self._retries, self._repeats, self._strict = retries, repeats, strict
        self._legs = legs_of(task)
        self._subgoal = self._legs[0].subgoal if self._legs else Subgoal()

    def intents(self) -> Iterator[Intent]:
        """See :class:`~agents.expert.course.Course`."""
        try:
            yield from self._prelude()
            for leg in self._legs:
                self._subgoal = leg.subgoal
                yield from self._leg(leg)
            yield from self._finish()
        except GiveUp:
            yield Intent(Action(verbs.END), "finish", self._subgoal)

    # -- for subclasses --------------------------------------------------------------------------

    def _prelude(self) -> Intents:
        """What comes before the legs; nothing by default."""
        yield from ()
        return False

    def _find(self, leg: Leg) -> Intents:
        """Go to where a leg's key actions can be done."""
        raise NotImplementedError

    # -- legs ------------------------------------------------------------------------------------

    def _leg(self, leg: Leg) -> Intents:
        left = self._left(leg)
        if leg.actions and not left:
            return True
        there = (
            bool(left) and self._legal(leg.actions[left[0]]) and leg.navigate not in self.view.left
        )
        if not there and (leg.actions or not self._within_reach(leg.thing)):
            yield from self._find(leg)
        for index in left:
            if index in self._left(leg):
                self._subgoal = leg.subgoals[index]
                yield from self._do_key(leg.actions[index], leg)
        if not leg.actions:
            yield from self._reach_thing(leg)
        return True

    def _do_key(self, key: KeyAction, leg: Leg) -> Intents:
        """Do a key action, and go nearer first where it is not legal."""
        for attempt in range(_TRIES):
            action = self._legal(key)
            if action is not None:
                purpose = purpose_of(key, leg, self.view.held)
                if (yield from self._do(Intent(action, purpose, self._subgoal))):
                    return True
            if self._strict:
                raise GiveUp
            yield from self._get_closer(key, leg, attempt)
        raise GiveUp

    def _get_closer(self, key: KeyAction, leg: Leg, attempt: int) -> Intents:
        """One of the ways to bring an object within reach."""
        name = self._known(key.actual_type)
        to_open = Action(verbs.OPEN, name)
        if key.verb == verbs.PUT and to_open in self.view.legal:
            return (yield from self._do(Intent(to_open, "open to put", self._subgoal)))
        ways = [name, self._known(leg.place), ""]
        goal = ways[min(attempt, len(ways) - 1)]
        if goal in self.view.navigable:
            action = Action(verbs.NAVIGATE, goal)
        else:
            action = Action(verbs.MOVE_FORWARD)
        return (yield from self._do(Intent(action, "get closer", self._subgoal)))

    def _reach_thing(self, leg: Leg) -> Intents:
        """After a search: come so near that the object found is within reach."""
        for attempt in range(_TRIES):
            if self._within_reach(leg.thing):
                return True
            if self._strict:
                raise GiveUp
            nearer = leg.thing if leg.thing in self.view.navigable else ""
            action = Action(verbs.NAVIGATE, nearer) if nearer else Action(verbs.MOVE_FORWARD)
            if attempt and nearer:
                action = Action(verbs.MOVE_FORWARD)
            yield from self._do(Intent(action, "get closer", self._subgoal))
        raise GiveUp

    def _finish(self) -> Intents:
        """Check the result if that was drawn, and end."""
        checked = self._check
        moves = self._task.type.group == TRANSPORT or self._task.type.ordered
        if checked and moves and not self._strict and self.view.steps_left > _RESERVE + 1:
            yield from self._do(
                Intent(Action(verbs.MOVE_FORWARD), "check", self._subgoal, checked=checked)
            )
            checked = ""
        yield Intent(Action(verbs.END), "finish", self._subgoal, checked=checked)
        return True

    # -- steps -----------------------------------------------------------------------------------

    def _do(self, intent: Intent) -> Intents:
        """Take one action, again if the environment let it fail; returns whether it was done."""
        if self.view.steps_left <= _RESERVE:
            raise GiveUp
        yield intent
        tries = 0
        while not self.view.success and tries < self._retries and self._can_retry():
            tries += 1
            yield replace(intent, purpose="retry", checked="", train=True)
        done = self.view.success
        repeatable = bool(intent.action.object_type) and self._can_retry()
        if done and self._repeats and repeatable and self._random.random() < self._repeats:
            yield replace(intent, purpose="repeat", checked="", train=False)
            while self.view.info["fault"] and self._can_retry():  # perhaps it is elsewhere now
                yield replace(intent, purpose="retry", checked="", train=True)
        return done

    def _can_retry(self) -> bool:
        return self.view.steps_left > _RESERVE + 1

    def _go(self, place: str, purpose: Purpose, plan: tuple[str, ...] = ()) -> Intents:
        """Navigate to a type."""
        action = Action(verbs.NAVIGATE, place)
        return (yield from self._do(Intent(action, purpose, self._subgoal, plan)))

    def _visit(self, place: str, leg: Leg, plan: tuple[str, ...]) -> Intents:
        """Search a place, a closed container too; returns whether the object is in view."""
        yield from self._go(place, "search", plan)
        return (yield from self._look_inside(place, leg))

    def _look_inside(self, place: str, leg: Leg) -> Intents:
        """Open a container at which the agent is, and close it again if the object is not there."""
        if self._in_view(leg.thing):
            return True
        to_open, to_close = Action(verbs.OPEN, place), Action(verbs.CLOSE, place)
        inside = search_priors.opens(place) and search_priors.has(leg.thing, "pickupable")
        if not inside or to_open not in self.view.legal:
            return False
        yield from self._do(Intent(to_open, "open to look", self._subgoal))
        if self._in_view(leg.thing):
            return True
        if to_close in self.view.legal:
            yield from self._do(Intent(to_close, "close again", self._subgoal))
        return False

    def _look_around(self) -> Intents:
        action = Action(verbs.OBSERVE)
        return (yield from self._do(Intent(action, "look around", self._subgoal)))

    def _go_back(self, seen: Sighting, wanted: str) -> Intents:
        """Go where something was seen, until the agent may navigate to a type."""
        for place in self._ways(seen):
            if self._known(wanted):
                break
            yield from self._go(place, "approach")
        return bool(self._known(wanted))

    # -- what is known ---------------------------------------------------------------------------

    def _left(self, leg: Leg) -> tuple[int, ...]:
        """The indices of a leg's actions that are not done."""
        return keys_left(self._legs, self.view.left)[self._legs.index(leg)]

    def _legal(self, key: KeyAction) -> Action | None:
        """The action that does a key action now; None if none is legal."""
        name = key.actual_type
        for candidate in (name, BASIN_OF.get(name, name)):
            action = Action(key.verb, candidate)
            if action in self.view.legal:
                return action
        return None

    def _known(self, wanted: str) -> str:
        """The name under which the agent may navigate to a type, ``""`` if it may not."""
        if wanted in self.view.navigable:
            return wanted
        return next((name for name in self.view.navigable if same_type(name, wanted)), "")

    def _ways(self, seen: Sighting) -> list[str]:
        """Where the agent may go for something that it has seen, the best first."""
        ways = (name for name in seen.ways if name in self.view.navigable)
        return [name for name in ways if name != self._memory.at][:_WAYS]

    def _in_view(self, thing: str) -> bool:
        return any(same_type(name, thing) for name in self.view.visible) and (
            self.view.held != thing
        )

    def _within_reach(self, thing: str) -> bool:
        return any(same_type(name, thing) for name in self.view.reach)
