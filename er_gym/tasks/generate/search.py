"""Searches: go to the place of an object and open the receptacle that hides it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule, from_templates, plan_from
from er_gym.tasks.goal import Condition
from er_gym.tasks.wordings.english import ENGLISH


def search(graph: SceneGraph, obj: SceneObject) -> TaskPlan:
    """The plan to find an object."""
    builder = PlanBuilder(graph)
    builder.visit(obj)
    return plan_from(builder, obj, goal=(Condition(obj.type, in_reach=True),))


def _each(graph: SceneGraph, hidden: bool) -> Iterator[tuple[SceneObject]]:
    return ((obj,) for obj in graph.pickupable_objects(hidden))


RULES = tuple(
    TaskRule(
        name,
        choices=partial(_each, hidden=hidden),
        plan=search,
        instructions=from_templates(ENGLISH.templates["find"].seen),
        may_name_places=False,
    )
    for name, hidden in (("single_search", False), ("single_search_from_closerep", True))
)
