"""The agent's and the camera's height and the room's bounds, beside the recorded ones."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from er_gym.thor import make_controller

WITHIN = 0.25
"""Bounds agree when each of their six faces is within so many metres."""


@dataclass(frozen=True)
class Rooms:
    """Differences to the captures, metres.

    Attributes:
        agent: (S,) of the height of the agent, after it has been put at the recorded x and z.
        camera: (S,) of the height of the camera over the agent.
        faces: scene to (6,), recorded less ours: lower x, y, z, upper x, y, z of the bounds.
    """

    agent: np.ndarray
    camera: np.ndarray
    faces: dict[str, np.ndarray]

    @property
    def missed(self) -> dict[str, np.ndarray]:
        """The scenes of which a face is farther off than :data:`WITHIN`."""
        return {scene: d for scene, d in self.faces.items() if (abs(d) > WITHIN).any()}

    @property
    def faces_right(self) -> float:
        """The share of faces that are not."""
        return float(np.mean(abs(np.array(list(self.faces.values()))) <= WITHIN))


def rooms(captures: Mapping[str, Any]) -> Rooms:
    """Compare over all scenes captured."""
    agent, camera, faces = [], [], {}
    controller = make_controller(headless=True)
    for scene, capture in captures.items():
        controller.reset(scene)
        x, y, z = capture["agent"]["position"]
        start = controller.last_event.metadata["agent"]["position"]["y"]
        event = controller.step(
            action="TeleportFull", x=x, y=start, z=z, rotation=capture["agent"]["rotation"],
            horizon=0, standing=capture["agent"]["isStanding"], forceAction=True,
        )  # fmt: skip
        ours = event.metadata["agent"]["position"]["y"]
        agent.append(ours - y)
        lift = capture["cameraPosition"][1] - y
        camera.append(event.metadata["cameraPosition"]["y"] - ours - lift)
        faces[scene] = _faces(capture["sceneBounds"]) - _faces(event.metadata["sceneBounds"])
    controller.stop()
    return Rooms(np.array(agent), np.array(camera), faces)


def _faces(bounds: Mapping[str, Any]) -> np.ndarray:
    center, size = (
        np.array([*v.values()] if isinstance(v, Mapping) else v)
        for v in (bounds["center"], bounds["size"])
    )
    return np.concatenate([center - size / 2, center + size / 2])
