"""Rooms made by hand, small enough to see which tasks they have."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from er_gym.tasks import TASK_TYPES, Task
from er_gym.tasks.generate import Generator
from er_gym.tasks.types import TRANSPORT

Objects = list[dict[str, Any]]
TRANSFERS = tuple(kind.name for kind in TASK_TYPES if kind.group == TRANSPORT)
SEQUENCE = "ordered_pickup_two_object_and_put"
FLAGS = (
    "receptacle", "pickupable", "openable", "isOpen", "toggleable", "isToggled", "isPickedUp",
    "dirtyable", "isDirty", "canFillWithLiquid", "cookable", "isCooked", "sliceable",
)  # fmt: skip


def thing(
    object_type: str,
    *parents: str | dict[str, Any],
    number: int = 1,
    size: float = 1.0,
    x: float = 0.0,
    **fields: Any,
) -> dict[str, Any]:
    """An object's metadata, as far as the generator reads it; a parent by its type is number 1."""
    holders = [
        f"{parent}|+00.00|+00.00|+01.00" if isinstance(parent, str) else parent["objectId"]
        for parent in parents
    ]
    return {
        "objectId": f"{object_type}|+00.00|+00.00|+0{number}.00",
        "objectType": object_type,
        "parentReceptacles": holders or None,
        "controlledObjects": None,
        "axisAlignedBoundingBox": {
            "center": {"x": x, "y": 0.0, "z": float(number)},
            "size": {"x": size, "y": size, "z": size},
        },
        **dict.fromkeys(FLAGS, False),
        **fields,
    }


FLOOR = thing("Floor", size=9, receptacle=True)
TABLE = thing("DiningTable", "Floor", "Chair", receptacle=True)
CHAIR = thing("Chair", "Floor", size=5, receptacle=True)
COUNTER = thing("CounterTop", receptacle=True)
FRIDGE = thing("Fridge", "Floor", receptacle=True, openable=True)
MICROWAVE = thing("Microwave", "CounterTop", receptacle=True, openable=True, toggleable=True)
TOILET = thing("Toilet", "Floor", receptacle=True, openable=True)
BOX = thing("Box", "Floor", receptacle=True, openable=True, isOpen=True, pickupable=True)
BOWL = thing("Bowl", "CounterTop", receptacle=True, pickupable=True)
FURNITURE = [FLOOR, TABLE, CHAIR, COUNTER, FRIDGE]
APPLE = thing("Apple", "Chair", "DiningTable", pickupable=True)
EGG = thing("Egg", "Fridge", pickupable=True)

MUG = thing("Mug", "CounterTop", pickupable=True)

DESK = thing("Desk", receptacle=True)
SHELF = thing("Shelf", receptacle=True)
DRAWER = thing("Drawer", receptacle=True, openable=True)
OFFICE = [DESK, SHELF, DRAWER]


def everywhere(what: str, where: str) -> bool:
    return True


def nowhere(what: str, where: str) -> bool:
    return False


def room_of(objects: Objects, accepts: Callable[[str, str], bool] = everywhere) -> Generator:
    return Generator("FloorPlan1", objects, accepts=accepts)


def tasks_of(
    name: str, objects: Objects, accepts: Callable[[str, str], bool] = everywhere
) -> list[Task]:
    return list(room_of(objects, accepts).tasks([name]))


def book(number: int, *parents: str | dict[str, Any]) -> dict[str, Any]:
    return thing("Book", *parents, pickupable=True, number=number)


def steps(task: Task) -> list[str]:
    return [f"{action.verb} {action.object_type}".strip() for action in task.key_actions]


def subjects(tasks: Iterable[Task]) -> set[str]:
    return {task.related_objects[0].split("|")[0] for task in tasks}


def about(task: Task) -> str:
    """A task's id without what all ids of its scene and type have in common."""
    return task.id.removeprefix(f"FloorPlan1-{task.type.name}-")
