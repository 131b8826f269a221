"""Searches: go to where a thing is, open what hides it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from er_gym.tasks.generate.scene_graph import Room, Thing
from er_gym.tasks.generate.script import Script
from er_gym.tasks.generate.task_plan import Plan, Row, from_templates, plan_of
from er_gym.tasks.generate.templates import FIND
from er_gym.tasks.goal import Condition


def search(room: Room, thing: Thing) -> Plan:
    """Find a thing."""
    script = Script(room)
    script.visit(thing)
    return plan_of(script, thing, goal=(Condition(thing.type, in_reach=True),))


def _each(room: Room, hidden: bool) -> Iterator[tuple[Thing]]:
    return ((thing,) for thing in room.carried(hidden))


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
