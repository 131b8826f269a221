"""Lines that pictures show: paths, a grid, a frame around an object."""

from __future__ import annotations

from typing import Any

import numpy as np

from er_gym.sim.actions.checks import FARTHEST, within
from er_gym.sim.actions.navigation import get_shortest_path
from er_gym.sim.actions.query import places_of
from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.look import Line
from er_gym.sim.object_metadata import vector
from er_gym.sim.world import World

Points = list[tuple[float, float, float]]
_PATH = "PathVisualization"
_WIDTH, _FRAME_WIDTH, _THIN = 0.045, 0.095, 0.015
"""AI2-THOR's widths of a path, of a frame, and of one of several paths, metres."""
_LIFT = 0.005
"""Height of a grid above the floor, metres."""
_MOST = 4096
"""Points of all lines: more would make pictures slow."""


def _draw(world: World, name: str, points: Points, width: float, posts: bool = False) -> None:
    """Draw a line, instead of one of the same name."""
    for point in points:
        for axis, part in zip("xyz", point, strict=True):
            within(axis, part, -FARTHEST, FARTHEST)
    within("width", width, 0.0, 10.0)
    others = [line for line in world.lines if line.name != name]
    if sum(len(line.points) for line in others) + len(points) > _MOST:
        raise ActionFailed(
            f"Lines have {_MOST} points at most in all; HideVisualizedPath ends one."
        )
    world.lines = (*others, Line(name, tuple(points), width, posts))
    world.state_changed()


@action("VisualizePath")
def visualize_path(
    world: World,
    *,
    positions: list[Vector],
    pathWidth: float = _WIDTH,
    startText: str = "",
    endText: str = "",
    pathGradient: dict[str, Any] | None = None,
    grid: bool = False,
    gridColor: dict[str, float] | None = None,
    gridWidth: float = _WIDTH,
    displayCount: bool = False,
    pathName: str = _PATH,
) -> None:
    """Show a path in pictures, with ``grid`` the reachable positions as well.

    It takes the place of an earlier one of the same name. Texts and colours have no effect.
    """
    if not positions:
        raise ActionFailed("Path cannot be null or empty.")
    _draw(world, pathName, [(p.x, p.y, p.z) for p in positions], pathWidth, posts=True)
    if grid:
        visualize_grid(world)


@action("HideVisualizedPath")
def hide_visualized_path(world: World, *, pathName: str = _PATH) -> None:
    """Take a path out of pictures again."""
    world.lines = tuple(line for line in world.lines if line.name != pathName)
    world.state_changed()


@action("VisualizeGrid")
def visualize_grid(world: World) -> list[dict[str, float]]:
    """Show the reachable positions in pictures, row by row; returns them."""
    places = places_of(world, None)
    y = world.ground + _LIFT
    for row, x in enumerate(np.unique(places[:, 0]).tolist()):
        along = np.sort(places[places[:, 0] == x, 1])
        gaps = np.flatnonzero(np.diff(along) > 1.01 * world.settings.grid_size) + 1
        for part, piece in enumerate(np.split(along, gaps)):
            _draw(world, f"grid {row} {part}", [(x, y, z) for z in piece.tolist()], _THIN)
    height = float(world.agent.position[1])
    return [vector(np.array([x, height, z])) for x, z in places.tolist()]


@action("VisualizeShortestPaths", server_action=True)
def visualize_shortest_paths(
    world: World,
    *,
    objectType: str | None = None,
    objectId: str | None = None,
    positions: list[Vector] | None = None,
) -> list[bool]:
    """Show the shortest paths from some positions to an object; returns which of them there are."""
    found = []
    for number, position in enumerate(positions or ()):
        try:
            path = get_shortest_path(
                world, objectType=objectType, objectId=objectId, position=position, allowedError=0.1
            )
        except ActionFailed:
            found.append(False)
            continue
        points = [(c["x"], c["y"] + 2 * _LIFT, c["z"]) for c in path["corners"]]
        _draw(world, f"{_PATH} {number}", points, _THIN, posts=True)
        found.append(True)
    return found


@action("HighlightObject")
def highlight_object(
    world: World, *, objectId: str, lineWidth: float = _FRAME_WIDTH, height: float | None = 2.0
) -> None:
    """Show a frame around an object's box in pictures, at a height in metres; None for its top."""
    i = world.find(objectId)
    (x0, _, z0), (x1, top, z1) = world.low[i].tolist(), world.high[i].tolist()
    y = top if height is None else height
    corners = [(x0, y, z0), (x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0)]
    _draw(world, f"{objectId}_highlight", corners, lineWidth)
