"""Searches: go to where a thing is, open what hides it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.generate.script import Script
from er_gym.tasks.generate.task_plan import Plan, Row, from_templates, plan_of
from er_gym.tasks.generate.templates import FIND
from er_gym.tasks.goal import Condition


def search(graph: SceneGraph, obj: SceneObject) -> Plan:
    """Find a thing."""
    script = Script(graph)
    script.visit(obj)
    return plan_of(script, obj, goal=(Condition(obj.type, in_reach=True),))


def _each(graph: SceneGraph, hidden: bool) -> Iterator[tuple[SceneObject]]:
    return ((obj,) for obj in graph.pickupable_objects(hidden))


ROWS = tuple(
    Row(
        name,
        choices=partial(_each, hidden=hidden),
        plan=search,
        sayings=from_templates(FIND),
        names_places=False,
    )
    for name, hidden in (("single_search", False), ("single_search_from_closerep", True))
)
