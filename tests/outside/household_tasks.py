"""A type of task of another package: docs/extending.md."""

from collections.abc import Iterator

from er_gym.tasks.generate.scene_graph import Room, Thing
from er_gym.tasks.generate.script import Script
from er_gym.tasks.generate.task_plan import Plan, Row, from_templates, plan_of
from er_gym.tasks.types import MANIPULATE, TaskType, register


def shut_things(room: Room) -> Iterator[tuple[Thing]]:
    """Everything that stands free and is shut."""
    return ((thing,) for thing in room.things.values() if thing.closed and not thing.pickupable)


def leave_open(room: Room, thing: Thing) -> Plan:
    """Go there and open it."""
    script = Script(room)
    script.go(thing, thing)
    script.open(thing)
    script.becomes(thing, isOpen=True)
    return plan_of(script, thing)


SAYINGS = ("Open {an_object}.", "Leave the {object} open.", "Would you open {an_object}?")
OPEN = register(
    TaskType(
        name="single_open",
        title="Opening",
        group=MANIPULATE,
        env_id="Household-Open-v0",
        max_steps=24,
        rows=(Row("single_open", shut_things, leave_open, from_templates(SAYINGS)),),
    )
)
