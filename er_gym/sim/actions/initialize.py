"""Settings of an episode: ``Initialize`` and the resolution."""

from __future__ import annotations

from typing import Any

from er_gym.sim.actions.agents import set_agents
from er_gym.sim.actions.checks import field_of_view, within
from er_gym.sim.actions.move import snap_to_grid
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.crew import MOST_AGENTS, act_as
from er_gym.sim.errors import ActionFailed
from er_gym.sim.size import LARGEST_SIDE, check_size
from er_gym.sim.space.frustum import NEAR_PLANE
from er_gym.sim.world import World

_FAR_PLANE = 20.0
_LARGEST_GRID = 5.0
"""AI2-THOR's largest gridSize, metres; it must also be above 0."""
_SMALLEST_LENGTH = 1e-6
"""A shorter length counts as zero, metres."""
_SMALLEST_TURN = 1.0
_FARTHEST_SIGHT = 1000.0
"""A visibilityDistance of this or more covers any room, metres."""


def _either(flag: bool | None, old_name: bool | None) -> bool | None:
    """The value of a flag that has a new and an old name."""
    return old_name if flag is None else flag


@action("Initialize", server_action=True)
def initialize(
    world: World,
    *,
    gridSize: float = 0.0,
    snapToGrid: bool | None = None,
    visibilityDistance: float = 0.0,
    fieldOfView: float = 0.0,
    rotateStepDegrees: float | None = None,
    timeScale: float = 1.0,
    renderDepthImage: bool | None = None,
    renderInstanceSegmentation: bool | None = None,
    renderSemanticSegmentation: bool | None = None,
    renderClassImage: bool | None = None,
    renderObjectImage: bool | None = None,
    agentMode: str = "default",
    agentCount: int = 1,
    makeAgentsVisible: bool = True,
) -> dict[str, Any]:
    """Set the engine's settings; distances in metres, angles in degrees.

    Refusals have AI2-THOR's wording. 0 stands for a default, and a ``visibilityDistance`` that is
    not positive is ignored. The embedded engine has no arm and no drone, and refuses requests for
    these. Further agents start near the first one. All other arguments of AI2-THOR's
    ``Initialize`` are accepted without effect (docs/fidelity.md lists them), and so are unknown
    ones.
    """
    if agentMode.lower() not in ("default", ""):
        raise ActionFailed(
            f"The embedded engine has agentMode 'default' only, not {quoted(agentMode)}; "
            "use backend='unity' for others."
        )
    if agentCount > MOST_AGENTS:
        raise ActionFailed(
            f"The embedded engine has up to {MOST_AGENTS} agents, not {quoted(agentCount)}."
        )
    if fieldOfView:
        field_of_view("fov", fieldOfView)
    if timeScale <= 0.0:
        raise ActionFailed(f"Time scale must be > 0, not {timeScale:g}.")
    if rotateStepDegrees is not None and rotateStepDegrees < _SMALLEST_TURN:
        raise ActionFailed(
            "rotateStepDegrees must be a non-zero, non-negative float, "
            f"{_SMALLEST_TURN:g} or more, not {rotateStepDegrees:g}."
        )
    if gridSize and not _SMALLEST_LENGTH < gridSize <= _LARGEST_GRID:
        raise ActionFailed(f"grid size must be in the range (0,5], not {gridSize:g}.")
    sight = min(visibilityDistance, _FARTHEST_SIGHT)
    chosen = {
        "grid_size": gridSize or None,
        "snap_to_grid": snapToGrid,
        "visibility_distance": sight if sight > 0.0 else None,
        "field_of_view": fieldOfView or None,
        "rotate_step": rotateStepDegrees,
        "render_depth": renderDepthImage,
        "render_instances": _either(renderInstanceSegmentation, renderObjectImage),
        "render_classes": _either(renderSemanticSegmentation, renderClassImage),
        "agents": max(agentCount, 1),
        "agents_visible": makeAgentsVisible,
    }
    act_as(world, 0)
    settings, agent = world.settings, world.agent
    world.configure(**{name: value for name, value in chosen.items() if value is not None})
    if world.settings.snap_to_grid:
        snap_to_grid(world)
    if agentCount > 1 or world.others:
        try:
            set_agents(world, world.settings.agents)
        except ActionFailed:
            world.settings = settings
            world.place_agent(agent)
            raise
    return {"cameraNearPlane": NEAR_PLANE, "cameraFarPlane": _FAR_PLANE}


@action("ChangeResolution")
def change_resolution(world: World, *, x: int, y: int) -> None:
    """Set the width and height of frames in pixels."""
    within("x", x, 1, LARGEST_SIDE)
    within("y", y, 1, LARGEST_SIDE)
    try:
        check_size(x, y)
    except ValueError as error:
        raise ActionFailed(f"{error}.") from None
    world.configure(width=x, height=y)


@action("ChangeQuality")
def change_quality(world: World, *, quality: str) -> None:
    """Accepted without effect: the embedded engine has one quality."""
