"""The steps that recipes consist of: what each does to a plan, and how an instruction words it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import permutations

from er_gym.tasks import verbs
from er_gym.tasks.generate.plan_builder import ImpossiblePlan, PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject, may_put_into
from er_gym.tasks.verbs import Verb
from er_gym.tasks.wordings.words import in_or_on_the


@dataclass
class RecipeRun:
    """The state of a recipe while its steps are planned one after another.

    Attributes:
        graph: the scene.
        builder: collects the key actions.
        objects: role to the object that has it now. Slicing gives the role of a Potato to a
            PotatoSliced.
        dirty: ids of the objects that must be dirty when the episode begins.
    """

    graph: SceneGraph
    builder: PlanBuilder
    objects: dict[str, SceneObject]
    dirty: list[str]

    def only(self, object_type: str) -> SceneObject:
        """The only object of a type.

        Raises:
            ImpossiblePlan: the scene has none, or several.
        """
        found = self.graph.of_type(object_type)
        if len(found) != 1:
            raise ImpossiblePlan(f"{len(found)} {object_type} objects")
        return found[0]


# -- moving and switching ------------------------------------------------------------------------


def _put(run: RecipeRun, what: str, where: str) -> str:
    """Put an object into or onto another."""
    obj, target = run.objects[what], run.objects[where]
    _transfer(run, obj, target)
    return f"put the {obj.type} {in_or_on_the(target.type)}"


def _switch_on(run: RecipeRun, what: str) -> str:
    """Switch an object on; a StoveBurner by its StoveKnob."""
    obj = run.objects[what]
    knobs = [k for k in run.graph.objects.values() if obj.id in k.controlled]
    if not obj.toggleable and not knobs:
        raise ImpossiblePlan(f"{obj.type} has no switch")
    if run.builder.is_on(obj) or any(knob.on for knob in knobs):
        raise ImpossiblePlan(f"{obj.type} is on already")
    run.builder.go_and_toggle(obj)
    for food, pan in permutations(run.objects.values(), 2):
        lies_there = run.builder.lies_in(food, pan) and run.builder.lies_in(pan, obj)
        if food.cookable and lies_there:
            run.builder.set_state(food, isCooked=True)
    return f"turn on the {obj.type}"


def _switch_off(run: RecipeRun, what: str) -> str:
    """Switch an object off."""
    obj = run.objects[what]
    if not obj.toggleable or not run.builder.is_on(obj):
        raise ImpossiblePlan(f"{obj.type} is off already")
    run.builder.go_and_toggle(obj)
    return f"turn off the {obj.type}"


# -- water, heat and cold ------------------------------------------------------------------------


def _wash(run: RecipeRun, what: str) -> str:
    """Put an object into the sink, turn on the water, and pick the object up again."""
    obj = run.objects[what]
    if obj.dirtyable:
        run.dirty.append(obj.id)
        run.builder.set_state(obj, isDirty=False)
    _hold_under_water(run, obj)
    return f"wash the {obj.type} in the SinkBasin with water from the Faucet"


def _fill(run: RecipeRun, what: str) -> str:
    """Fill an object with water, and pick it up again."""
    obj = run.objects[what]
    if not obj.fillable:
        raise ImpossiblePlan(f"{obj.type} holds no water")
    _hold_under_water(run, obj)
    return f"fill the {obj.type} in the SinkBasin with water from the Faucet"


def _brew(run: RecipeRun, what: str) -> str:
    """Make coffee into a mug, and pick the mug up again."""
    obj = run.objects[what]
    _use_appliance(run, obj, "CoffeeMachine", isFilledWithLiquid=True)
    return f"fill the {obj.type} with coffee from the CoffeeMachine"


def _toast(run: RecipeRun, what: str) -> str:
    """Toast a slice, and take it out again."""
    obj = run.objects[what]
    _use_appliance(run, obj, "Toaster", isCooked=True)
    return f"toast the {obj.type} in the Toaster"


def _heat(run: RecipeRun, what: str) -> str:
    """Heat an object in the microwave, and take it out again."""
    obj, microwave = run.objects[what], run.only("Microwave")
    if microwave.on:
        raise ImpossiblePlan("the Microwave is on already")
    _transfer(run, obj, microwave)
    run.builder.close(microwave)
    run.builder.toggle(microwave)
    run.builder.toggle(microwave)
    run.builder.fetch(obj)
    if obj.cookable:
        run.builder.set_state(obj, isCooked=True)
    return f"heat the {obj.type} in the Microwave, turning it on and off again"


def _chill(run: RecipeRun, what: str) -> str:
    """Cool an object in the closed fridge, and take it out again."""
    obj, fridge = run.objects[what], run.only("Fridge")
    _transfer(run, obj, fridge)
    run.builder.close(fridge)
    run.builder.fetch(obj)
    return f"cool the {obj.type} in the closed Fridge"


# -- tools ---------------------------------------------------------------------------------------


def _slice(run: RecipeRun, what: str, knife: str) -> str:
    """Slice an object where it lies, put the knife down there, and go on with a slice."""
    builder, blade, obj = run.builder, run.objects[knife], run.objects[what]
    if not obj.sliceable:
        raise ImpossiblePlan(f"{obj.type} cannot be sliced")
    board = builder.place_of(obj)
    if board.openable or not may_put_into(board) or not run.graph.accepts(blade.type, board.type):
        raise ImpossiblePlan(f"no slicing in {board.type}")
    builder.fetch(blade)
    builder.go_to(board, obj)
    run.objects[what] = builder.slice(obj)
    builder.put(board)
    return (
        f"slice the {obj.type} with the {blade.type} and lay the {blade.type} down "
        f"{in_or_on_the(board.type)}"
    )


def _do(verb: Verb, run: RecipeRun, what: str) -> str:
    """Do a verb to an object where it lies, or in the hand."""
    obj, builder = run.objects[what], run.builder
    if not verb.takes(obj.type):
        raise ImpossiblePlan(f"one cannot {verb.name} {obj.type}")
    if builder.held is not None and verb.hand == verbs.EMPTY:
        raise ImpossiblePlan(f"the hand holds {builder.held.type}")
    if builder.held is None and verb.hand == verbs.FULL:
        raise ImpossiblePlan("the hand is empty")
    if builder.held == obj and not verb.in_hand:
        raise ImpossiblePlan(f"one cannot {verb.name} what is in the hand")
    if verb.object_state == ("isDirty", True):
        run.dirty.append(obj.id)
    builder.do(verb, obj)
    return f"{verb.name} the {obj.type}"


def _do_with(verb: Verb, run: RecipeRun, what: str, tool: str) -> str:
    """Fetch a tool, do a verb with it to an object where that lies, and put the tool down there."""
    obj, instrument, builder = run.objects[what], run.objects[tool], run.builder
    place = builder.place_of(obj)
    if instrument.type not in verb.hand:
        raise ImpossiblePlan(f"one cannot {verb.name} with {instrument.type}")
    if not may_put_into(place) or not run.graph.accepts(instrument.type, place.type):
        raise ImpossiblePlan(f"{place.type} does not take {instrument.type}")
    builder.fetch(instrument)
    said = _do(verb, run, what)
    builder.put(place)
    return f"{said} with the {instrument.type} and leave that {in_or_on_the(place.type)}"


# -- parts of steps ------------------------------------------------------------------------------


def _transfer(run: RecipeRun, obj: SceneObject, target: SceneObject) -> None:
    """Fetch an object and put it into a target that accepts its type."""
    if run.builder.lies_in(obj, target) or run.builder.taken_from(obj) == target:
        raise ImpossiblePlan(f"{obj.type} is there, or has just been there")
    if not run.graph.accepts(obj.type, target.type):
        raise ImpossiblePlan(f"{target.type} does not take {obj.type}")
    run.builder.fetch(obj)
    run.builder.put(target)


def _hold_under_water(run: RecipeRun, obj: SceneObject) -> None:
    water = run.graph.sink_and_faucet()
    if water is None:
        raise ImpossiblePlan("no water")
    basin, faucet = water
    _transfer(run, obj, basin)
    if not run.builder.is_on(faucet):
        run.builder.toggle(faucet)
    run.builder.pickup(obj)
    if obj.fillable:
        run.builder.set_state(obj, isFilledWithLiquid=True)


def _use_appliance(run: RecipeRun, obj: SceneObject, appliance_type: str, **state: bool) -> None:
    """Put an object into an open appliance, switch that on, and pick the object up again."""
    appliance = run.only(appliance_type)
    if run.builder.is_on(appliance):
        raise ImpossiblePlan(f"the {appliance_type} is on already")
    _transfer(run, obj, appliance)
    run.builder.toggle(appliance)
    run.builder.pickup(obj)
    run.builder.set_state(obj, **state)


# -- the table -----------------------------------------------------------------------------------

STEPS: Mapping[str, Callable[..., str]] = {
    "put": _put,
    "wash": _wash,
    "fill": _fill,
    "brew": _brew,
    "heat": _heat,
    "chill": _chill,
    "toast": _toast,
    "slice": _slice,
    "switch_on": _switch_on,
    "switch_off": _switch_off,
}
"""Step name to the function that plans the step.

The function takes the :class:`RecipeRun` and the step's roles. It returns the step as an imperative
clause for the instruction, and raises :class:`ImpossiblePlan` where the step cannot be done.
"""


def steps() -> Mapping[str, Callable[..., str]]:
    """:data:`STEPS`, and a step ``do VERB`` for each verb that another package adds.

    Verbs that take no object have no step. The roles of ``do VERB`` are the object and, if the verb
    needs a tool in the hand, the tool.
    """
    added = {f"do {verb.name}": _step_of_verb(verb) for verb in verbs.ADDED if not verb.alone}
    return {**STEPS, **added}


def _step_of_verb(verb: Verb) -> Callable[..., str]:
    needs_tool = not isinstance(verb.hand, str)
    return partial(_do_with, verb) if needs_tool else partial(_do, verb)
