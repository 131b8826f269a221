"""Acting a task out on paper: key actions as they come, and what they leave behind."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

from er_gym.tasks import verbs
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import KeyAction
from er_gym.tasks.verbs import Verb
from er_gym.thor import OBJECT_TYPES


class ImpossiblePlan(Exception):
    """The script cannot go on; the message says why. Most ways to fill a recipe are impossible."""


class PlanBuilder:
    """What the agent does, one thing after another, and how the room then is.

    What has been opened to get at a thing is closed again: after a pickup at once, after a put when
    the agent goes on, so that the last put of all leaves it open.

    Args:
        room: where.
        stays: whether going to where one is already needs no key action.
    """

    def __init__(self, graph: SceneGraph, merge_visits: bool = False) -> None:
        self.graph = graph
        self.actions: list[KeyAction] = []
        self.handled: list[SceneObject] = []
        """What it takes hold of, switches or fills, unless that is what one goes to itself."""
        self.held: SceneObject | None = None
        self._merge_visits = merge_visits
        self._at: SceneObject | None = None
        self._inside: dict[
            str, SceneObject
        ] = {}  # id of a thing that was moved, to what it lies in
        self._left: dict[str, SceneObject] = {}  # and to what it was taken out of again
        self._open: dict[str, SceneObject] = {}  # what was opened and not closed again
        self._on: dict[str, bool] = {}
        self._states: dict[SceneObject, dict[str, bool | str]] = {}

    # -- asking ----------------------------------------------------------------------------------

    def place_of(self, obj: SceneObject) -> SceneObject:
        """What one goes to for a thing, where it now is."""
        moved_into = self._inside.get(obj.id)
        if moved_into is None:
            return self.graph.place_of(obj)
        return self.place_of(moved_into) if moved_into.pickupable else moved_into

    def is_on(self, obj: SceneObject) -> bool:
        """Whether it is switched on by now."""
        return self._on.get(obj.id, obj.on)

    def lies_in(self, obj: SceneObject, target: SceneObject) -> bool:
        """Whether a thing lies in a target by now."""
        moved_into = self._inside.get(obj.id)
        return self.graph.is_in(obj, target) if moved_into is None else moved_into == target

    def taken_from(self, obj: SceneObject) -> SceneObject | None:
        """What the script put a thing into and took it out of again."""
        return self._left.get(obj.id)

    def _is_closed(self, obj: SceneObject) -> bool:
        return obj.closed and obj.id not in self._open

    # -- doing -----------------------------------------------------------------------------------

    def go_to(self, place: SceneObject, reason: SceneObject) -> None:
        """Go to a receptacle because of what is in it, or to a thing itself."""
        if self._merge_visits and self._at == place:
            return
        if self._at != place:
            for obj in list(self._open.values()):
                self.close(obj)
        related = tuple(dict.fromkeys((place.id, reason.id)))
        self.actions.append(KeyAction(verbs.NAVIGATE, place.id, place.type, related))
        self._at = place

    def open(self, obj: SceneObject) -> None:
        """Open it, if it is closed."""
        if self._is_closed(obj):
            self._do(verbs.OPEN, obj)
            self._open[obj.id] = obj

    def close(self, obj: SceneObject) -> None:
        """Shut it, if the script opened it."""
        if self._open.pop(obj.id, None):
            self._do(verbs.CLOSE, obj)

    def visit(self, obj: SceneObject) -> SceneObject:
        """Go to where a thing is and open what hides it; returns the place."""
        place = self.place_of(obj)
        self.go_to(place, obj)
        self.open(place)
        return place

    def fetch(self, obj: SceneObject) -> None:
        """Go to where a thing is and take it, leaving the place as it was."""
        if self.held == obj:
            return
        place = self.visit(obj)
        self.pickup(obj)
        self.close(place)

    def pickup(self, obj: SceneObject) -> None:
        """Take a thing from where the agent stands."""
        if self.held is not None:
            raise ImpossiblePlan(f"the hand holds {self.held.type} already")
        if not obj.pickupable:
            raise ImpossiblePlan(f"{obj.id} cannot be carried")
        self._do(verbs.PICKUP, obj)
        self._handle(obj)
        self.held = obj
        moved_into = self._inside.pop(obj.id, None)
        if moved_into is not None:
            self._left[obj.id] = moved_into

    def put(self, target: SceneObject) -> None:
        """Put what is in the hand into a target, going to where that is."""
        if self.held is None:
            raise ImpossiblePlan("the hand is empty")
        if not target.receptacle or target == self.held:
            raise ImpossiblePlan(f"{self.held.id} cannot be put into {target.id}")
        place = target if not target.pickupable else self.place_of(target)
        self.go_to(place, target)
        self.open(place)
        self.open(target)
        self._do(verbs.PUT, target)
        if target != place:
            self._handle(target)
        self._inside[self.held.id] = target
        self.held = None

    def go_and_toggle(self, obj: SceneObject) -> None:
        """Go to where a thing is and switch it."""
        self.visit(obj)
        self._handle(obj)
        self.toggle(obj)

    def toggle(self, obj: SceneObject) -> None:
        """Switch a thing on, or off if it is on; the agent is there."""
        knobs = (knob for knob in self.graph.objects.values() if obj.id in knob.controlled)
        if not obj.toggleable and not any(knobs):
            raise ImpossiblePlan(f"{obj.id} has no switch")
        self._do(verbs.TOGGLE, obj)
        self._on[obj.id] = not self.is_on(obj)
        if obj.toggleable:  # a burner has its state in its knob
            self.set_state(obj, isToggled=self._on[obj.id])

    def slice(self, obj: SceneObject) -> SceneObject:
        """Cut up a thing where the agent stands, with the knife in its hand; returns a slice."""
        self._do(verbs.SLICE, obj)
        kind = f"{obj.type}Sliced"
        cookable = "cookable" in OBJECT_TYPES[kind].properties
        slice_id = f"{obj.id}|{kind}_0"
        part = replace(obj, id=slice_id, type=kind, sliceable=False, cookable=cookable)
        if obj.id in self._inside:
            self._inside[part.id] = self._inside.pop(obj.id)
        return part

    def do(self, verb: Verb, obj: SceneObject) -> None:
        """Do a verb to a thing, going to where that is unless it is in the hand."""
        if obj != self.held:
            self.visit(obj)
        self._do(verb.name, obj)
        self._handle(obj)
        if verb.makes:
            self.set_state(obj, **dict(verb.makes))

    def set_state(self, obj: SceneObject, **state: bool | str) -> None:
        """Note what a thing's metadata must say in the end."""
        self._states.setdefault(obj, {}).update(state)

    def _do(self, verb: str, obj: SceneObject) -> None:
        self.actions.append(KeyAction(verb, obj.id, obj.type, (obj.id,)))

    def _handle(self, obj: SceneObject) -> None:
        if obj not in self.handled:
            self.handled.append(obj)

    # -- what comes of it ------------------------------------------------------------------------

    def key_actions(self) -> tuple[KeyAction, ...]:
        """All of them, and ``end``."""
        involved = dict.fromkeys(chain.from_iterable(a.related_objects for a in self.actions))
        return (*self.actions, KeyAction(verbs.END, related_objects=tuple(involved)))

    def goal(self) -> tuple[Condition, ...]:
        """How things are in the end: what was moved, switched or changed."""
        found: dict[str, Condition] = {}
        for obj in self.handled:
            if obj == self.held:
                found[obj.id] = Condition(obj.type, held=True)
            elif obj.id in self._inside:
                found[obj.id] = Condition(obj.type, inside=self._inside[obj.id].type)
        for obj, state in self._states.items():
            condition = found.get(obj.id) or Condition(obj.type)
            found[obj.id] = replace(condition, state=tuple(state.items()))
        return tuple(found.values())
