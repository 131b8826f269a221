"""Acting a task out on paper: key actions as they come, and what they leave behind."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

from er_gym.tasks import verbs
from er_gym.tasks.generate.scene_graph import Room, Thing
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import KeyAction
from er_gym.tasks.verbs import Verb
from er_gym.thor import OBJECT_TYPES


class Impossible(Exception):
    """The script cannot go on; the message says why. Most ways to fill a recipe are impossible."""


class Script:
    """What the agent does, one thing after another, and how the room then is.

    What has been opened to get at a thing is closed again: after a pickup at once, after a put when
    the agent goes on, so that the last put of all leaves it open.

    Args:
        room: where.
        stays: whether going to where one is already needs no key action.
    """

    def __init__(self, room: Room, stays: bool = False) -> None:
        self.room = room
        self.actions: list[KeyAction] = []
        self.handled: list[Thing] = []
        """What it takes hold of, switches or fills, unless that is what one goes to itself."""
        self.held: Thing | None = None
        self._stays = stays
        self._at: Thing | None = None
        self._inside: dict[str, Thing] = {}  # id of a thing that was moved, to what it lies in
        self._left: dict[str, Thing] = {}  # and to what it was taken out of again
        self._open: dict[str, Thing] = {}  # what was opened and not closed again
        self._on: dict[str, bool] = {}
        self._states: dict[Thing, dict[str, bool | str]] = {}

    # -- asking ----------------------------------------------------------------------------------

    def place_of(self, thing: Thing) -> Thing:
        """What one goes to for a thing, where it now is."""
        moved_into = self._inside.get(thing.id)
        if moved_into is None:
            return self.room.place_of(thing)
        return self.place_of(moved_into) if moved_into.pickupable else moved_into

    def is_on(self, thing: Thing) -> bool:
        """Whether it is switched on by now."""
        return self._on.get(thing.id, thing.on)

    def lies_in(self, thing: Thing, target: Thing) -> bool:
        """Whether a thing lies in a target by now."""
        moved_into = self._inside.get(thing.id)
        return self.room.is_in(thing, target) if moved_into is None else moved_into == target

    def comes_from(self, thing: Thing) -> Thing | None:
        """What the script put a thing into and took it out of again."""
        return self._left.get(thing.id)

    def _is_closed(self, thing: Thing) -> bool:
        return thing.closed and thing.id not in self._open

    # -- doing -----------------------------------------------------------------------------------

    def go(self, place: Thing, reason: Thing) -> None:
        """Go to a receptacle because of what is in it, or to a thing itself."""
        if self._stays and self._at == place:
            return
        if self._at != place:
            for thing in list(self._open.values()):
                self.close(thing)
        related = tuple(dict.fromkeys((place.id, reason.id)))
        self.actions.append(KeyAction(verbs.NAVIGATE, place.id, place.type, related))
        self._at = place

    def open(self, thing: Thing) -> None:
        """Open it, if it is closed."""
        if self._is_closed(thing):
            self._do(verbs.OPEN, thing)
            self._open[thing.id] = thing

    def close(self, thing: Thing) -> None:
        """Shut it, if the script opened it."""
        if self._open.pop(thing.id, None):
            self._do(verbs.CLOSE, thing)

    def visit(self, thing: Thing) -> Thing:
        """Go to where a thing is and open what hides it; returns the place."""
        place = self.place_of(thing)
        self.go(place, thing)
        self.open(place)
        return place

    def fetch(self, thing: Thing) -> None:
        """Go to where a thing is and take it, leaving the place as it was."""
        if self.held == thing:
            return
        place = self.visit(thing)
        self.pickup(thing)
        self.close(place)

    def pickup(self, thing: Thing) -> None:
        """Take a thing from where the agent stands."""
        if self.held is not None:
            raise Impossible(f"the hand holds {self.held.type} already")
        if not thing.pickupable:
            raise Impossible(f"{thing.id} cannot be carried")
        self._do(verbs.PICKUP, thing)
        self._handle(thing)
        self.held = thing
        moved_into = self._inside.pop(thing.id, None)
        if moved_into is not None:
            self._left[thing.id] = moved_into

    def put(self, target: Thing) -> None:
        """Put what is in the hand into a target, going to where that is."""
        if self.held is None:
            raise Impossible("the hand is empty")
        if not target.receptacle or target == self.held:
            raise Impossible(f"{self.held.id} cannot be put into {target.id}")
        place = target if not target.pickupable else self.place_of(target)
        self.go(place, target)
        self.open(place)
        self.open(target)
        self._do(verbs.PUT, target)
        if target != place:
            self._handle(target)
        self._inside[self.held.id] = target
        self.held = None

    def switch(self, thing: Thing) -> None:
        """Go to where a thing is and switch it."""
        self.visit(thing)
        self._handle(thing)
        self.toggle(thing)

    def toggle(self, thing: Thing) -> None:
        """Switch a thing on, or off if it is on; the agent is there."""
        knobs = (knob for knob in self.room.things.values() if thing.id in knob.controlled)
        if not thing.toggleable and not any(knobs):
            raise Impossible(f"{thing.id} has no switch")
        self._do(verbs.TOGGLE, thing)
        self._on[thing.id] = not self.is_on(thing)
        if thing.toggleable:  # a burner has its state in its knob
            self.becomes(thing, isToggled=self._on[thing.id])

    def slice(self, thing: Thing) -> Thing:
        """Cut up a thing where the agent stands, with the knife in its hand; returns a slice."""
        self._do(verbs.SLICE, thing)
        kind = f"{thing.type}Sliced"
        cookable = "cookable" in OBJECT_TYPES[kind].properties
        slice_id = f"{thing.id}|{kind}_0"
        part = replace(thing, id=slice_id, type=kind, sliceable=False, cookable=cookable)
        if thing.id in self._inside:
            self._inside[part.id] = self._inside.pop(thing.id)
        return part

    def do(self, verb: Verb, thing: Thing) -> None:
        """Do a verb to a thing, going to where that is unless it is in the hand."""
        if thing != self.held:
            self.visit(thing)
        self._do(verb.name, thing)
        self._handle(thing)
        if verb.makes:
            self.becomes(thing, **dict(verb.makes))

    def becomes(self, thing: Thing, **state: bool | str) -> None:
        """Note what a thing's metadata must say in the end."""
        self._states.setdefault(thing, {}).update(state)

    def _do(self, verb: str, thing: Thing) -> None:
        self.actions.append(KeyAction(verb, thing.id, thing.type, (thing.id,)))

    def _handle(self, thing: Thing) -> None:
        if thing not in self.handled:
            self.handled.append(thing)

    # -- what comes of it ------------------------------------------------------------------------

    def key_actions(self) -> tuple[KeyAction, ...]:
        """All of them, and ``end``."""
        involved = dict.fromkeys(chain.from_iterable(a.related_objects for a in self.actions))
        return (*self.actions, KeyAction(verbs.END, related_objects=tuple(involved)))

    def goal(self) -> tuple[Condition, ...]:
        """How things are in the end: what was moved, switched or changed."""
        found: dict[str, Condition] = {}
        for thing in self.handled:
            if thing == self.held:
                found[thing.id] = Condition(thing.type, held=True)
            elif thing.id in self._inside:
                found[thing.id] = Condition(thing.type, inside=self._inside[thing.id].type)
        for thing, state in self._states.items():
            condition = found.get(thing.id) or Condition(thing.type)
            found[thing.id] = replace(condition, state=tuple(state.items()))
        return tuple(found.values())
