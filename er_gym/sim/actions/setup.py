"""What the client says before an episode: settings and resolution."""

from __future__ import annotations

from typing import Any

from er_gym.sim.actions.checks import FIELDS_OF_VIEW, within
from er_gym.sim.actions.move import snap_to_grid
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.errors import INVALID_ARGUMENT, ActionFailed
from er_gym.sim.space.visibility import NEAR_PLANE
from er_gym.sim.world import World

_FAR_PLANE = 20.0


def _either(flag: bool | None, old_name: bool | None) -> bool | None:
    """A flag that may come under its new name, its old one, both or neither."""
    return old_name if flag is None else flag


@action("Initialize")
def initialize(
    world: World,
    *,
    gridSize: float | None = None,
    snapToGrid: bool | None = None,
    continuous: bool | None = None,
    visibilityDistance: float | None = None,
    fieldOfView: float | None = None,
    rotateStepDegrees: float | None = None,
    renderDepthImage: bool | None = None,
    renderInstanceSegmentation: bool | None = None,
    renderSemanticSegmentation: bool | None = None,
    renderClassImage: bool | None = None,
    renderObjectImage: bool | None = None,
    renderNormalsImage: bool | None = None,
    agentMode: str = "default",
    agentCount: int = 1,
    massThreshold: float | None = None,
    visibilityScheme: str | None = None,
    makeAgentsVisible: bool = True,
    fastActionEmit: bool = True,
) -> dict[str, Any]:
    """Set what the engine goes by; distances in metres, angles in degrees.

    ``agentMode`` other than "default" and more than one agent are refused: the embedded engine has
    neither arm, drone nor crowd. ``massThreshold`` is accepted and has no effect, for nothing here
    is pushed.
    """
    if agentMode.lower() != "default":
        raise ActionFailed(
            f"The embedded engine has agentMode 'default' only, not {quoted(agentMode)}; "
            "use backend='unity' for others.",
            INVALID_ARGUMENT,
        )
    if agentCount != 1:
        raise ActionFailed(
            f"The embedded engine has one agent, not {agentCount}.", INVALID_ARGUMENT
        )
    within("gridSize", gridSize, 0.01, 10.0)
    within("visibilityDistance", visibilityDistance, 0.0, 1000.0)
    within("fieldOfView", fieldOfView, *FIELDS_OF_VIEW)
    within("rotateStepDegrees", rotateStepDegrees, 1.0, 360.0)
    if continuous is not None and snapToGrid is None:
        snapToGrid = not continuous
    chosen = {
        "grid_size": gridSize,
        "snap_to_grid": snapToGrid,
        "visibility_distance": visibilityDistance,
        "field_of_view": fieldOfView,
        "rotate_step": rotateStepDegrees,
        "render_depth": renderDepthImage,
        "render_instances": _either(renderInstanceSegmentation, renderObjectImage),
        "render_classes": _either(renderSemanticSegmentation, renderClassImage),
    }
    world.configure(**{name: value for name, value in chosen.items() if value is not None})
    if world.settings.snap_to_grid:
        snap_to_grid(world)
    return {"cameraNearPlane": NEAR_PLANE, "cameraFarPlane": _FAR_PLANE}


@action("ChangeResolution")
def change_resolution(world: World, *, x: int, y: int) -> None:
    """Set the width and height of frames in pixels."""
    within("x", x, 1, 8192)
    within("y", y, 1, 8192)
    world.configure(width=x, height=y)


@action("ChangeQuality")
def change_quality(world: World, *, quality: str = "") -> None:
    """Accepted for the client's sake: the embedded engine draws in one quality."""
