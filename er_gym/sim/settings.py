"""What ``Initialize`` and the camera actions set."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What ``Initialize`` sets; lengths in metres, angles in degrees."""

    grid_size: float = 0.25
    snap_to_grid: bool = True
    visibility_distance: float = 1.5
    field_of_view: float = 90.0
    rotate_step: float = 90.0
    width: int = 300
    height: int = 300
    render_depth: bool = False
    render_instances: bool = False
    render_classes: bool = False

    @property
    def draws_colors(self) -> bool:
        """Whether a segmentation image is drawn, in which each object has a colour of its own."""
        return self.render_instances or self.render_classes


@dataclass(frozen=True)
class ThirdPartyCamera:
    """A camera that stands in the room.

    Attributes:
        position: x, y and z, metres, world frame.
        rotation: Unity's Euler angles about x, y and z, degrees.
        field_of_view: vertical, degrees.
    """

    position: tuple[float, float, float]
    rotation: tuple[float, float, float]
    field_of_view: float
