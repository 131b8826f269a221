"""Where the agent can stand: as recorded at 0.25 m, filled in at 0.1 m."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er_gym.sim.scene import SCENE_NAMES, Scene, load_scene
from er_gym.sim.world import AGENT_HEIGHT, Settings, World
from er_gym.thor import make_controller

_FINE = 0.1
_BODY = 0.1, 1.5  # what ends lower or begins higher than this over the floor is in nobody's way
_TOUCH = 0.01


@dataclass(frozen=True)
class Reachable:
    """Counts over the 120 scenes.

    Attributes:
        exact: scenes whose positions at 0.25 m are the recorded ones.
        connected: scenes whose positions at 0.1 m fall into as many pieces as the recorded ones.
        positions: at 0.1 m, all scenes together.
        outside: those beyond the box of the Floor.
        in_furniture: those inside a part of the furniture that no recorded position is in.
        in_doubt: those inside a part that a recorded position is in, too: the record wins.
    """

    exact: int = 0
    connected: int = 0
    positions: int = 0
    outside: int = 0
    in_furniture: int = 0
    in_doubt: int = 0


def reachable() -> Reachable:
    """Compare over the 120 scenes."""
    counts = np.zeros(6, dtype=int)
    controller = make_controller(headless=True)
    for name in SCENE_NAMES:
        scene = load_scene(name)
        controller.reset(name)
        coarse, fine = (_positions(controller, step) for step in (0.25, _FINE))
        half = scene.aabb_size / 2
        floor = scene.types.index("Floor")
        low, high = (scene.aabb_center + sign * half for sign in (-1, 1))
        beyond = (fine < low[floor, [0, 2]]) | (fine > high[floor, [0, 2]])
        in_furniture, in_doubt = _in_furniture(scene, fine)
        counts += (
            sorted(coarse.tolist()) == sorted(scene.reachable.tolist()),
            pieces(fine, _FINE) == pieces(scene.reachable, 0.25),
            len(fine),
            beyond.any(axis=1).sum(),
            in_furniture,
            in_doubt,
        )
    controller.stop()
    return Reachable(*counts.tolist())


def _positions(controller: object, step: float) -> np.ndarray:
    event = controller.step(action="GetReachablePositions", gridSize=step)  # type: ignore[attr-defined]
    return np.array([(p["x"], p["z"]) for p in event.metadata["actionReturn"]])


def _in_furniture(scene: Scene, points: np.ndarray) -> tuple[int, int]:
    """How many points are inside parts that the record keeps out of, and inside parts it enters."""
    world = World.load(scene, Settings())
    ground = world.agent.position[1] - AGENT_HEIGHT
    in_furniture = np.zeros(len(points), dtype=bool)
    in_doubt = np.zeros(len(points), dtype=bool)
    for i, kind in enumerate(scene.types):
        if kind == "Floor" or world.has(i, "pickupable"):
            continue
        for low, high in world.shape(i).boxes:
            if high[1] <= ground + _BODY[0] or low[1] >= ground + _BODY[1]:
                continue
            inner = low[[0, 2]] + _TOUCH, high[[0, 2]] - _TOUCH
            entered = ((scene.reachable > inner[0]) & (scene.reachable < inner[1])).all(axis=1)
            inside = ((points > inner[0]) & (points < inner[1])).all(axis=1)
            if entered.any():
                in_doubt |= inside
            else:
                in_furniture |= inside
    return int(in_furniture.sum()), int(in_doubt.sum())


def pieces(points: np.ndarray, step: float) -> int:
    """How many parts a grid falls into when one walks between 4-neighbours only."""
    left = {tuple(node) for node in np.round(points / step).astype(int).tolist()}
    count = 0
    while left:
        count += 1
        todo = [left.pop()]
        while todo:
            x, z = todo.pop()
            for neighbour in ((x + 1, z), (x - 1, z), (x, z + 1), (x, z - 1)):
                if neighbour in left:
                    left.remove(neighbour)
                    todo.append(neighbour)
    return count
