"""Whether objects that AI2-THOR opened from a recorded pose are interactable from there."""

from __future__ import annotations

import numpy as np

from er_gym.sim.agent import Agent
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.interactable_poses import interactable_poses
from er_gym.sim.space.recorded_floor import RECORDED_STEP
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World


def openable_poses(turn: float = 0.0) -> dict[str, tuple[int, int]]:
    """Type to (how many entries agree, how many there are), over the 120 scenes.

    An entry agrees when the object is interactable from its pose, or one within a step of the
    grid with the same rotation and horizon is among the object's interactable poses: agent
    standing, visibility distance 1.5 m, field of view 90 degrees.

    Args:
        turn: degrees to turn the recorded headings by, for a comparison that has to fail.
    """
    found: dict[str, tuple[int, int]] = {}
    for name in SCENE_NAMES:
        world = World.load(load_scene(name), Settings())
        height = world.agent.position[1]
        for i, pose in world.scene.openable_poses.items():
            rotation = pose.rotation + turn
            here = np.array([pose.x, height, pose.z])
            agrees = bool(visible(world, Agent(here, rotation, pose.horizon))[i])
            if not agrees:
                gaps = np.linalg.norm(world.scene.reachable - here[[0, 2]], axis=1)
                near = world.scene.reachable[gaps <= RECORDED_STEP + 1e-6]
                agrees = bool(
                    interactable_poses(world, i, near, [rotation], [pose.horizon], [True], 1).size
                )
            agreed, entries = found.get(world.types[i], (0, 0))
            found[world.types[i]] = agreed + agrees, entries + 1
    return found
