"""A camera in AI2-THOR's frame: x right, y up, z forward, left-handed; metres, degrees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_gym.sim.rotation import unity_rotation


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera's pose, field of view and picture size.

    Attributes:
        position: x, y and z of the eye.
        yaw: clockwise seen from above; 0 looks along +z, 90 along +x.
        horizon: positive looking down, as AI2-THOR's ``cameraHorizon``.
        fov: the vertical field of view, above 0 and below 180.
        width, height: of the picture, pixels.
        roll: about the view axis, Unity's angle about z.
        orthographic_size: half of what an orthographic camera sees from bottom to top, metres; None
            for a pinhole camera. Pixels and rays are those of a pinhole camera.
    """

    position: Sequence[float] | NDArray[np.float64]
    yaw: float
    horizon: float
    fov: float
    width: int
    height: int
    roll: float = 0.0
    orthographic_size: float | None = None

    @property
    def axes(self) -> NDArray[np.float64]:
        """(3, 3): the unit vectors to the camera's right, up and along its view, as rows."""
        return unity_rotation((self.horizon, self.yaw, self.roll)).T

    @property
    def focal(self) -> float:
        """The distance from the eye to the picture, in pixels."""
        return float(self.height / 2 / np.tan(np.radians(self.fov) / 2))

    def to_view(self, points: ArrayLike) -> NDArray[np.float64]:
        """World points (..., 3) in the camera's frame: metres right, up and along the view."""
        view: NDArray[np.float64] = (np.asarray(points) - self.position) @ self.axes.T
        return view

    def to_pixels(self, view: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (..., 3) of the camera's frame as pixel x, pixel y and depth.

        Pixel (0, 0) is the upper left corner of the picture, and (0.5, 0.5) the centre of its first
        pixel. Depth is measured along the view axis, in metres. The pixel of a point that is not in
        front of the camera (depth <= 0) has no meaning.
        """
        right, up, depth = np.moveaxis(view, -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = self.width / 2 + self.focal * right / depth
            y = self.height / 2 - self.focal * up / depth
        return np.stack([x, y, depth], axis=-1)

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """World points (..., 3) as pixel x, pixel y and depth: see :meth:`to_pixels`."""
        return self.to_pixels(self.to_view(points))

    def ray(self, x: float, y: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The line of sight through a point of the picture: where it starts, and the vector that
        advances 1 m along the view axis, both (3,).

        Args:
            x, y: 0 to 1, from the left and from the top.
        """
        aside = np.array([(2 * x - 1) * self.width / self.height, 1 - 2 * y, 0.0])
        ahead = np.array([0.0, 0.0, 1.0])
        start = np.array(self.position, dtype=np.float64)
        if self.orthographic_size is not None:
            return start + (aside * self.orthographic_size) @ self.axes, ahead @ self.axes
        half = float(np.tan(np.radians(self.fov) / 2))
        return start, (aside * half + ahead) @ self.axes

    def rays(self) -> NDArray[np.float32]:
        """The ray through each pixel's centre.

        Returns:
            (3, height, width) float32: x, y and z of the world vector that advances 1 m along the
                view axis. A surface at depth z in a pixel is at ``position + z * ray``.
        """
        x = (np.arange(self.width, dtype=np.float32) + 0.5 - self.width / 2) / self.focal
        y = (self.height / 2 - 0.5 - np.arange(self.height, dtype=np.float32)) / self.focal
        right, up, forward = self.axes.astype(np.float32)[:, :, None, None]
        rays: NDArray[np.float32] = right * x + (up * y[:, None] + forward)
        return rays
