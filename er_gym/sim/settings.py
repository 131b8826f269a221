"""What ``Initialize`` and the camera actions set."""

from __future__ import annotations

from dataclasses import dataclass

SOFT, FLAT = "soft", "flat"
LIGHTS = (SOFT, FLAT)
"""The lights that pictures are drawn in: light from windows and lamps with soft shadows, or the
same light everywhere."""


@dataclass(frozen=True)
class Settings:
    """What ``Initialize`` sets; lengths in metres, angles in degrees.

    The size of pictures and the light come from the engine, and no action changes the light.
    ``agents`` is how many a house gets. Those that are not ``agents_visible`` hide nothing.
    """

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
    light: str = SOFT
    agents: int = 1
    agents_visible: bool = True

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
        orthographic_size: half of what an orthographic camera sees from bottom to top, metres; None
            for a camera in perspective.
    """

    position: tuple[float, float, float]
    rotation: tuple[float, float, float]
    field_of_view: float
    orthographic_size: float | None = None
