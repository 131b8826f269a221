"""Tasks about one object where it is: pick it up, switch it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule, from_templates, plan_from
from er_gym.tasks.wordings.english import ENGLISH

NEVER_TOGGLED = frozenset({"StoveKnob", "StoveBurner", "LightSwitch"})


def pickup(graph: SceneGraph, obj: SceneObject) -> TaskPlan:
    """The plan to pick up an object."""
    builder = PlanBuilder(graph)
    builder.fetch(obj)
    return plan_from(builder, obj)


def toggle(graph: SceneGraph, obj: SceneObject) -> TaskPlan:
    """The plan to switch an object on or off."""
    builder = PlanBuilder(graph)
    builder.go_and_toggle(obj)
    return plan_from(builder, obj, way="off" if obj.on else "on")


def _carried(graph: SceneGraph, hidden: bool) -> Iterator[tuple[SceneObject]]:
    return ((obj,) for obj in graph.pickupable_objects(hidden))


def _switches(graph: SceneGraph) -> Iterator[tuple[SceneObject]]:
    for obj in graph.objects.values():
        if obj.toggleable and obj.type not in NEVER_TOGGLED and graph.is_exposed(obj):
            yield (obj,)


RULES = (
    *(
        TaskRule(
            name,
            choices=partial(_carried, hidden=hidden),
            plan=pickup,
            instructions=from_templates(ENGLISH.templates["pick up"].seen),
        )
        for name, hidden in (("single_pickup", False), ("single_pickup_from_closerep", True))
    ),
    TaskRule(
        "single_toggle",
        choices=_switches,
        plan=toggle,
        instructions=from_templates(ENGLISH.templates["toggle"].seen),
    ),
)
