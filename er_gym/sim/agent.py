"""The agent's pose, and where its camera and its hand are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

AGENT_HEIGHT = 0.900999128818512
"""AI2-THOR's height of the agent's centre above the top of the scene's Floor, metres."""
CAMERA_STANDING, CAMERA_CROUCHING = 0.675, 0.0
"""Height of the camera above the agent's centre, metres."""
HAND_OFFSET = np.array([0.0, -0.16, 0.38])
"""Position of the hand in the camera's frame (right, up, forward), metres."""


@dataclass(frozen=True)
class Agent:
    """The agent's pose in AI2-THOR's world frame.

    Attributes:
        position: (3,) of its centre, metres.
        rotation: degrees, clockwise from +z seen from above.
        horizon: tilt of the camera, degrees, positive looking down.
        standing: False while it crouches.
    """

    position: NDArray[np.float64]
    rotation: float = 0.0
    horizon: float = 0.0
    standing: bool = True

    @property
    def eye(self) -> tuple[float, float, float]:
        """:attr:`camera` as plain numbers, which is faster for one look."""
        x, y, z = self.position.tolist()
        return x, y + (CAMERA_STANDING if self.standing else CAMERA_CROUCHING), z

    @property
    def camera(self) -> NDArray[np.float64]:
        """Position (3,) of the camera, metres."""
        lift = CAMERA_STANDING if self.standing else CAMERA_CROUCHING
        return np.asarray(self.position + np.array([0.0, lift, 0.0]))
