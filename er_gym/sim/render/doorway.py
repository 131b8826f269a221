"""The door of a room: its place in a wall, and its mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from er_gym.sim.render.floor_plan import Floats, FloorPlan, Wall, floor_plan
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import Palette, mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.scene import Scene, load_scene

WIDTH, HEIGHT = 0.98, 2.1
"""Size of the door with its frame, metres."""
_FRAME, _CLEAR, _DEEP, _NEAR = 0.08, 0.06, 0.5, 0.95
"""Width of the frame; free space beside and in front of the door; distance to a walker, metres."""
_STEP = 0.1
_WHITE: Colour = (0.94, 0.93, 0.90)
_BRASS: Colour = (0.80, 0.66, 0.36)


@dataclass(frozen=True)
class Doorway:
    """The place of a door.

    Attributes:
        wall: the wall that it is in.
        along: coordinate of its middle along the wall.
        at: (x, z) of its middle.
        yaw: the direction that it faces, degrees.
    """

    wall: Wall
    along: float
    at: tuple[float, float]
    yaw: float


def doorway(scene_name: str) -> Doorway | None:
    """The door's place: a free stretch of wall near a light switch that the agent can walk to.

    None in a house, whose doors are objects.
    """
    scene, plan = load_scene(scene_name), floor_plan(scene_name)
    if scene.shell is not None:
        return None
    if plan.ceiling - plan.ground < HEIGHT + 0.05:
        return None
    switches = np.array(
        [scene.aabb_center[i, ::2] for i, kind in enumerate(scene.types) if kind == "LightSwitch"]
    ).reshape(-1, 2)
    choices = [choice for wall in plan.walls for choice in _free(scene, plan, wall)]

    def unlikely(choice: Doorway) -> float:
        middle = scene.reachable.mean(axis=0)
        far = np.linalg.norm(switches - choice.at, axis=1)
        return float(far.min(initial=9.0) - 0.01 * np.linalg.norm(middle - choice.at))

    return min(choices, key=unlikely, default=None)


def _free(scene: Scene, plan: FloorPlan, wall: Wall) -> Iterator[Doorway]:
    """Places at a wall with nothing in front of them, where the agent can stand."""
    axis, side = 2 * wall.axis, 2 - 2 * wall.axis
    low, high = scene.aabb_center - scene.aabb_size / 2, scene.aabb_center + scene.aabb_size / 2
    near = np.sort(wall.sign * (np.stack([low, high])[:, :, axis] - wall.at), axis=0)
    in_the_way = (near[0] < _DEEP) & (near[1] > -0.3) & (high[:, 1] > plan.ground + 0.05)
    in_the_way &= low[:, 1] < plan.ground + HEIGHT + _CLEAR
    walkers: Floats = scene.reachable[wall.sign * (scene.reachable[:, wall.axis] - wall.at) < _NEAR]
    walkers = walkers[wall.sign * (walkers[:, wall.axis] - wall.at) > 0]
    reach = WIDTH / 2 + _CLEAR
    for along in np.arange(wall.low + reach, wall.high - reach + 1e-6, _STEP).tolist():
        blocked = in_the_way & (low[:, side] < along + reach) & (high[:, side] > along - reach)
        if not blocked.any() and (np.abs(walkers[:, 1 - wall.axis] - along) < 0.3).any():
            at = (wall.at, along) if wall.axis == 0 else (along, wall.at)
            yaw = 90.0 * wall.sign if wall.axis == 0 else 90.0 - 90.0 * wall.sign
            yield Doorway(wall, along, at, yaw)


def door(colours: Palette, scene_name: str) -> Mesh:
    """A panel with two fields in a frame, and a knob. Its back is at z = 0, and it faces z."""
    mesh, number = Mesh(), int(scene_name.removeprefix("FloorPlan"))
    material, panel = (
        ("plain", _WHITE) if number % 2 else ("wood", mixed(colours.wood, _WHITE, 0.15))
    )
    frame = mixed(panel, _WHITE, 0.5)
    inner, tall = WIDTH - 2 * _FRAME, HEIGHT - _FRAME
    for x in (-1, 1):
        mesh.box(
            (x * (WIDTH - _FRAME) / 2, HEIGHT / 2, 0.025),
            (_FRAME, HEIGHT, 0.05),
            frame,
            faces="xXYZ",
        )
    mesh.box((0, HEIGHT - _FRAME / 2, 0.025), (inner, _FRAME, 0.05), frame, faces="yZ")
    mesh.panel((0, tall / 2, 0.015), (inner, tall), panel, material, turns=1.0)
    for low, high in ((0.12, 0.95), (1.12, 1.9)):
        middle, size = (low + high) / 2, (inner - 0.26, high - low)
        mesh.panel((0, middle, 0.025), size, shaded(panel, 0.78), material, turns=1.0)
        mesh.panel(
            (0, middle, 0.035),
            (size[0] - 0.06, size[1] - 0.06),
            shaded(panel, 0.97),
            material,
            turns=1.0,
        )
    mesh.ball((inner / 2 - 0.07, 1.02, 0.075), (0.07, 0.07, 0.07), _BRASS, segments=8, rings=5)
    mesh.cylinder((inner / 2 - 0.07, 1.02, 0.035), 0.02, 0.05, _BRASS, axis="z", segments=6)
    return mesh
