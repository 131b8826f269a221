"""The solver: it knows the key actions, and plays them as a careful agent would."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from er_gym.envs.actions import Action
from er_gym.envs.info import action_of, detail
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF, same_type
from er_gym.tasks.task import KeyAction, type_of_id


class Solver:
    """Does a task's key actions in order, and the actions that each of them needs first.

    It navigates to the object of a key action. If that is not in sight, it looks round, then goes
    from object to object until it is. If an object is out of reach, the solver goes to it, then to
    the receptacle that it lies in, then a step forward. It opens a closed receptacle before it puts
    an object in. It knows only the key actions beforehand and reads the rest as any agent may. One
    solver plays one episode.
    """

    def __init__(self) -> None:
        self._went: list[str] = []
        self._looked = False
        self._tried: dict[KeyAction, int] = {}
        self._current: KeyAction | None = None

    def next(self, info: Mapping[str, Any]) -> tuple[Action, KeyAction | None]:
        """The next action, and the key action that it serves (None if all are done).

        Args:
            info: what the last ``env.reset`` or ``env.step`` returned, with details
                (:func:`er_gym.envs.info.with_details`).
        """
        plan = [key for key in detail(info, "keys_left") if key.verb != verbs.END]
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
        stuck = action_of(info) == Action(key.verb, key.actual_type) and not info["action_success"]
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
        """Look round once, then go from object to object, unvisited types first."""
        if not self._looked:
            self._looked = True
            return Action(verbs.OBSERVE)
        fresh = [name for name in info["navigable"] if name not in self._went]
        if not fresh:
            return Action(verbs.MOVE_FORWARD)
        self._went.append(fresh[0])
        return Action(verbs.NAVIGATE, fresh[0])


def _nearer(key: KeyAction, name: str, info: Mapping[str, Any]) -> Iterator[Action]:
    """The actions that may bring an object of a type within reach, in the order to try them.

    A small object can be out of reach from where the agent sees it best. Then it helps to go to its
    receptacle: objects of the types in it are interactable wherever they are visible.
    """
    if name in info["navigable"]:
        yield Action(verbs.NAVIGATE, name)
        for holder in _holders(key, info["keys_done"]):
            holder = _name_in(holder, info["navigable"])
            if holder in info["navigable"]:
                yield Action(verbs.NAVIGATE, holder)
        yield Action(verbs.NAVIGATE, name)
        yield Action(verbs.MOVE_FORWARD)


def _holders(key: KeyAction, done: Sequence[KeyAction]) -> Iterator[str]:
    """The types of the receptacles into which the agent has put an object, innermost first."""
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
    """The name under which a type is listed: a SinkBasin may be listed as its Sink."""
    for names in lists:
        if wanted in names:
            return wanted
        for name in names:
            if same_type(name, wanted):
                return name
    return wanted
