"""Doing something to one thing where it is: take it, switch it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from er_gym.tasks.generate.scene_graph import Room, Thing
from er_gym.tasks.generate.script import Script
from er_gym.tasks.generate.task_plan import Plan, Row, from_templates, plan_of
from er_gym.tasks.generate.templates import PICK_UP, TOGGLE

NEVER_TOGGLED = frozenset({"StoveKnob", "StoveBurner", "LightSwitch"})


def pickup(room: Room, thing: Thing) -> Plan:
    """Take a thing."""
    script = Script(room)
    script.fetch(thing)
    return plan_of(script, thing)


def toggle(room: Room, thing: Thing) -> Plan:
    """Switch a thing."""
    script = Script(room)
    script.switch(thing)
    return plan_of(script, thing, way="off" if thing.on else "on")


def _carried(room: Room, hidden: bool) -> Iterator[tuple[Thing]]:
    return ((thing,) for thing in room.carried(hidden))


def _switches(room: Room) -> Iterator[tuple[Thing]]:
    for thing in room.things.values():
        if thing.toggleable and thing.type not in NEVER_TOGGLED and room.is_exposed(thing):
            yield (thing,)


ROWS = (
    *(
        Row(
            name,
            choices=partial(_carried, hidden=hidden),
            plan=pickup,
            sayings=from_templates(PICK_UP),
        )
        for name, hidden in (("single_pickup", False), ("single_pickup_from_closerep", True))
    ),
    Row("single_toggle", choices=_switches, plan=toggle, sayings=from_templates(TOGGLE)),
)
