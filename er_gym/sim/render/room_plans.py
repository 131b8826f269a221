"""The rooms of a scene as they are drawn."""

from __future__ import annotations

from dataclasses import dataclass

from er_gym.sim.render.floor_plan import FloorPlan, floor_plan, plan_of_rooms
from er_gym.sim.render.palette import Palette, flooring, palette
from er_gym.sim.scene import load_scene, scene_category


@dataclass(frozen=True, eq=False)
class RoomPlan:
    """A room as it is drawn.

    Attributes:
        category: "kitchens", "living_rooms", "bedrooms" or "bathrooms".
        flooring: the material of its floor, and the metres of one repeat of its texture.
    """

    plan: FloorPlan
    category: str
    colours: Palette
    flooring: tuple[str, float]


def room_plans(scene_name: str) -> tuple[RoomPlan, ...]:
    """The rooms of a scene: one of a recorded scene, each in its own colours of a house."""
    shell = load_scene(scene_name).shell
    if shell is None:
        kind = scene_category(scene_name)
        return (RoomPlan(floor_plan(scene_name), kind, palette(scene_name), flooring(scene_name)),)
    return tuple(
        RoomPlan(
            plan_of_rooms((room,), shell),
            room.category,
            palette(f"{scene_name} {room.id}", room.category),
            flooring(f"{scene_name} {room.id}", room.category),
        )
        for room in shell.rooms
    )
