"""The ceiling: a player that knows the key actions, and plays them as a careful agent would."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF, same_type
from er_gym.tasks.task import KeyAction, type_of_id


class Solver:
    """Does a task's key actions in their order, and what it takes to be able to.

    It goes where a key action leads; if the place is not in sight it looks round, then walks to one
    thing after another that is, until the place is too. What it cannot reach it walks to, then to
    what that lies in, then a step nearer. It opens what is closed before it puts something in. What
    it knows beforehand are the key actions; all else it reads from ``info`` as any agent may. One
    solver plays one episode.
    """

    def __init__(self) -> None:
        self._went: list[str] = []
        self._looked = False
        self._tried: dict[KeyAction, int] = {}
        self._current: KeyAction | None = None

    def next(self, info: Mapping[str, Any]) -> tuple[Action, KeyAction | None]:
        """The next action, and the key action that it is for; None when all are done.

        Args:
            info: what the last ``env.reset`` or ``env.step`` returned.
        """
        plan = [key for key in info["key_actions_left"] if key.verb != verbs.END]
        if not plan:
            return Action(verbs.END), None
        key = plan[0]
        if key is not self._current:
            self._current, self._looked, self._went = key, False, []
        return self._towards(key, info), key

    def _towards(self, key: KeyAction, info: Mapping[str, Any]) -> Action:
        name = _name_in(key.actual_type, info["navigable"], info["interactable"])
        if key.verb == verbs.NAVIGATE:
            if name in info["navigable"]:
                return Action(verbs.NAVIGATE, name)
            return self._explore(info)
        stuck = info["action"] == Action(key.verb, key.actual_type) and not info["action_success"]
        if stuck and key.verb == verbs.OPEN and Action(verbs.TOGGLE, name) in info["legal"]:
            return Action(verbs.TOGGLE, name)  # an appliance opens only when it is off
        for candidate in (key.actual_type, BASIN_OF.get(key.actual_type, key.actual_type)):
            action = Action(key.verb, candidate)
            if action in info["legal"]:
                return action
        if key.verb == verbs.PUT:
            to_open = Action(verbs.OPEN, name)
            if to_open in info["legal"]:
                return to_open
        tried = self._tried[key] = self._tried.get(key, -1) + 1
        nearer = list(_nearer(key, name, info))
        return nearer[tried] if tried < len(nearer) else self._explore(info)

    def _explore(self, info: Mapping[str, Any]) -> Action:
        """Look round once, then go from thing to thing, those not visited yet first."""
        if not self._looked:
            self._looked = True
            return Action(verbs.OBSERVE)
        fresh = [name for name in info["navigable"] if name not in self._went]
        if not fresh:
            return Action(verbs.MOVE_FORWARD)
        self._went.append(fresh[0])
        return Action(verbs.NAVIGATE, fresh[0])


def _nearer(key: KeyAction, name: str, info: Mapping[str, Any]) -> Iterator[Action]:
    """What may bring something of a type within reach: what can be tried, in this order.

    Small things can be out of reach from where one sees them best. Then it helps to go to the
    receptacle, for what lies in that may be handled wherever it is visible.
    """
    if name in info["navigable"]:
        yield Action(verbs.NAVIGATE, name)
        for holder in _holders(key, info["key_actions_done"]):
            holder = _name_in(holder, info["navigable"])
            if holder in info["navigable"]:
                yield Action(verbs.NAVIGATE, holder)
        yield Action(verbs.NAVIGATE, name)
        yield Action(verbs.MOVE_FORWARD)


def _holders(key: KeyAction, done: Sequence[KeyAction]) -> Iterator[str]:
    """The types of what an object lies in, as far as it has been put there, innermost first."""
    lies_in: dict[str, str] = {}
    held = ""
    for earlier in done:
        if earlier.verb == verbs.PICKUP:
            held = earlier.object_id
        elif earlier.verb == verbs.PUT:
            lies_in[held] = earlier.object_id
    holder = lies_in.get(key.object_id)
    while holder:
        yield type_of_id(holder)
        holder = lies_in.pop(holder, "")


def _name_in(wanted: str, *lists: Sequence[str]) -> str:
    """The spelling under which a type is at hand: a SinkBasin may be there as its Sink."""
    for names in lists:
        if wanted in names:
            return wanted
        for name in names:
            if same_type(name, wanted):
                return name
    return wanted
