"""A builder that collects key actions and tracks how they change the scene."""

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
    """A plan cannot be continued; the message says why. Most choices for recipes are."""


class PlanBuilder:
    """Collects the key actions of a plan and tracks the state of the scene.

    Receptacles that the plan opened to reach an object are closed again: at once after a pickup,
    and before the next navigation after a put. So the last put leaves its receptacle open.

    Args:
        graph: the scene.
        merge_visits: whether navigation to the agent's present place adds no key action.
    """

    def __init__(self, graph: SceneGraph, merge_visits: bool = False) -> None:
        self.graph = graph
        self.actions: list[KeyAction] = []
        self.handled: list[SceneObject] = []
        """Objects that the agent picks up, switches or fills, without those it navigates to."""
        self.held: SceneObject | None = None
        self._merge_visits = merge_visits
        self._at: SceneObject | None = None
        self._inside: dict[str, SceneObject] = {}  # id of a moved object to its receptacle
        self._left: dict[str, SceneObject] = {}  # id of one picked up again to that receptacle
        self._open: dict[str, SceneObject] = {}  # id to object, for what the plan opened
        self._on: dict[str, bool] = {}
        self._states: dict[SceneObject, dict[str, bool | str]] = {}

    # -- asking ----------------------------------------------------------------------------------

    def place_of(self, obj: SceneObject) -> SceneObject:
        """The object to navigate to for an object, at its present place."""
        moved_into = self._inside.get(obj.id)
        if moved_into is None:
            return self.graph.place_of(obj)
        return self.place_of(moved_into) if moved_into.pickupable else moved_into

    def is_on(self, obj: SceneObject) -> bool:
        """Whether an object is switched on at present."""
        return self._on.get(obj.id, obj.on)

    def lies_in(self, obj: SceneObject, target: SceneObject) -> bool:
        """Whether an object lies in a target at present."""
        moved_into = self._inside.get(obj.id)
        return self.graph.is_in(obj, target) if moved_into is None else moved_into == target

    def taken_from(self, obj: SceneObject) -> SceneObject | None:
        """The receptacle into which the plan put an object before it picked it up again."""
        return self._left.get(obj.id)

    def _is_closed(self, obj: SceneObject) -> bool:
        return obj.closed and obj.id not in self._open

    # -- doing -----------------------------------------------------------------------------------

    def go_to(self, place: SceneObject, reason: SceneObject) -> None:
        """Navigate to an object; ``reason`` is the object that lies in it, or the same object."""
        if self._merge_visits and self._at == place:
            return
        if self._at != place:
            for obj in list(self._open.values()):
                self.close(obj)
        related = tuple(dict.fromkeys((place.id, reason.id)))
        self.actions.append(KeyAction(verbs.NAVIGATE, place.id, place.type, related))
        self._at = place

    def open(self, obj: SceneObject) -> None:
        """Open an object if it is closed."""
        if self._is_closed(obj):
            self._do(verbs.OPEN, obj)
            self._open[obj.id] = obj

    def close(self, obj: SceneObject) -> None:
        """Close an object if the plan opened it."""
        if self._open.pop(obj.id, None):
            self._do(verbs.CLOSE, obj)

    def visit(self, obj: SceneObject) -> SceneObject:
        """Navigate to the place of an object and open it; returns the place."""
        place = self.place_of(obj)
        self.go_to(place, obj)
        self.open(place)
        return place

    def fetch(self, obj: SceneObject) -> None:
        """Navigate to an object and pick it up; its place is closed again."""
        if self.held == obj:
            return
        place = self.visit(obj)
        self.pickup(obj)
        self.close(place)

    def pickup(self, obj: SceneObject) -> None:
        """Pick up an object at the agent's place.

        Raises:
            ImpossiblePlan: the hand is full, or the object is not pickupable.
        """
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
        """Navigate to a target and put the held object into it.

        Raises:
            ImpossiblePlan: the hand is empty, or the target is not another receptacle.
        """
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
        """Navigate to an object and switch it."""
        self.visit(obj)
        self._handle(obj)
        self.toggle(obj)

    def toggle(self, obj: SceneObject) -> None:
        """Switch an object at the agent's place on, or off if it is on.

        Raises:
            ImpossiblePlan: the object has no switch.
        """
        knobs = (knob for knob in self.graph.objects.values() if obj.id in knob.controlled)
        if not obj.toggleable and not any(knobs):
            raise ImpossiblePlan(f"{obj.id} has no switch")
        self._do(verbs.TOGGLE, obj)
        self._on[obj.id] = not self.is_on(obj)
        if obj.toggleable:  # a StoveBurner has its state in its StoveKnob
            self.set_state(obj, isToggled=self._on[obj.id])

    def slice(self, obj: SceneObject) -> SceneObject:
        """Slice an object at the agent's place with the held knife; returns the first slice."""
        self._do(verbs.SLICE, obj)
        kind = f"{obj.type}Sliced"
        cookable = "cookable" in OBJECT_TYPES[kind].properties
        slice_id = f"{obj.id}|{kind}_0"
        part = replace(obj, id=slice_id, type=kind, sliceable=False, cookable=cookable)
        if obj.id in self._inside:
            self._inside[part.id] = self._inside.pop(obj.id)
        return part

    def do(self, verb: Verb, obj: SceneObject) -> None:
        """Do a verb to an object; navigate to it first unless the agent holds it."""
        if obj != self.held:
            self.visit(obj)
        self._do(verb.name, obj)
        self._handle(obj)
        if verb.makes:
            self.set_state(obj, **dict(verb.makes))

    def set_state(self, obj: SceneObject, **state: bool | str) -> None:
        """Add metadata fields and their final values to the goal."""
        self._states.setdefault(obj, {}).update(state)

    def _do(self, verb: str, obj: SceneObject) -> None:
        self.actions.append(KeyAction(verb, obj.id, obj.type, (obj.id,)))

    def _handle(self, obj: SceneObject) -> None:
        if obj not in self.handled:
            self.handled.append(obj)

    # -- results ---------------------------------------------------------------------------------

    def key_actions(self) -> tuple[KeyAction, ...]:
        """The collected key actions and ``end``."""
        involved = dict.fromkeys(chain.from_iterable(a.related_objects for a in self.actions))
        return (*self.actions, KeyAction(verbs.END, related_objects=tuple(involved)))

    def goal(self) -> tuple[Condition, ...]:
        """The final state of all objects that were moved, switched or changed."""
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
