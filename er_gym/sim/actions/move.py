"""Moving: steps on the walkable floor, and teleports."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import remainder

import numpy as np

from er_gym.sim.actions.registry import action
from er_gym.sim.actions.rotate_look import LOOK_LIMITS, LOOK_TOLERANCE
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.agent import Agent
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.bodies import blocking
from er_gym.sim.space.room_bounds import room_corners
from er_gym.sim.space.walkable_floor import floor_of, standing_places
from er_gym.sim.world import World

_FARTHEST = 1000.0
"""Larger than any scene, metres."""
_WALL = "A wall"
_HEIGHT_TOLERANCE = 0.05
"""A position that is farther above or below is not on the floor, metres; AI2-THOR's value."""
_LEVEL = 0.01
"""Pitch and roll of a teleport must be less, degrees; AI2-THOR's value."""
_FINEST = 0.05
"""A grid with a smaller step is not searched for a free position, metres."""


def _step(
    world: World,
    magnitude: float | None,
    heading: float,
    near: tuple[str, float] | None = None,
    keep_hand: bool = False,
    through_agents: bool = False,
) -> None:
    """Step in a direction.

    Args:
        near: the id of an object, and how far from it the agent may end, metres.
        keep_hand: whether the hand stays as it is.
        through_agents: whether other agents are no obstacle.
    """
    size = world.settings.grid_size if magnitude is None else magnitude
    if size <= 0:
        raise ActionFailed(f"moveMagnitude must be > 0, not {size:g}.")
    if size > _FARTHEST:
        raise ActionFailed(f"{_WALL} is blocking Agent {world.acting} from moving by {size:g} m.")
    start, end = world.agent.position, step_end(world, size, heading)
    clear = floor_of(world.scene.name).path_is_clear(start[[0, 2]], end[[0, 2]])
    met = blocking(world, start, end) if clear and world.others and not through_agents else None
    if not clear or met is not None:
        by = ", ".join(f"{part + 0.0:.4f}" for part in (end - start).round(4).tolist())
        what = _obstacle(world, end) if met is None else f"Agent {met}"
        raise ActionFailed(f"{what} is blocking Agent {world.acting} from moving by ({by}).")
    if near is not None:
        _stay_near(world, end, *near)
    world.place_agent(replace(world.agent, position=end), keep_hand=keep_hand)


def step_ahead(world: World, magnitude: float) -> None:
    """``MoveAhead`` by some metres."""
    _step(world, magnitude, _HEADINGS["MoveAhead"])


def step_end(world: World, size: float, heading: float) -> np.ndarray:
    """(3,) metres: the end of a step if nothing is in the way, snapped to the grid if that is on.

    Args:
        size: length of the step, metres.
        heading: degrees clockwise from the agent's own heading.
    """
    angle = np.radians(world.agent.rotation + heading)
    end = world.agent.position + size * np.array([np.sin(angle), 0.0, np.cos(angle)])
    if world.settings.snap_to_grid:
        grid = world.settings.grid_size
        end[[0, 2]] = np.round(end[[0, 2]] / grid) * grid
    return np.asarray(end)


def snap_to_grid(world: World) -> None:
    """Move the agent to a corner of the grid square that it is in, as AI2-THOR's Initialize does.

    It takes the corner with the lowest x and z that it can walk to. If it can walk to none, it
    takes the nearest free position on the grid, if there is one. So all later steps stay on the
    grid.
    """
    grid = world.settings.grid_size
    here = world.agent.position
    low = np.floor(here[[0, 2]] / grid + 1e-6)
    corners = [((low + by) * grid).round(6) for by in ((0, 0), (0, 1), (1, 0), (1, 1))]
    if any(np.abs(corner - here[[0, 2]]).max() < 1e-5 for corner in corners):
        return
    floor = floor_of(world.scene.name)
    way_to = (corner for corner in corners if floor.path_is_clear(here[[0, 2]], corner))
    found = next(way_to, None)
    if found is None:
        if grid < _FINEST:
            return
        places = standing_places(world.scene.name, grid)
        if not len(places):
            return
        found = places[np.linalg.norm(places - here[[0, 2]], axis=1).argmin()]
    x, z = found
    world.place_agent(replace(world.agent, position=np.array([x, here[1], z])))


def _obstacle(world: World, end: np.ndarray) -> str:
    """The name of the standing object nearest to a position that the agent cannot reach, or a wall.

    An object is left out if its box already contains the agent: it is a counter that bends round
    it.
    """
    here = world.agent.position
    rows = [
        i
        for i in np.flatnonzero(world.exists)
        if world.low[i, 1] < 1.6
        and world.types[i] != "Floor"
        and world.high[i, 1] > 0.1
        and not ((world.low[i] < here) & (here < world.high[i]))[[0, 2]].all()
    ]
    gap = np.clip(end, world.low[rows], world.high[rows]) - end
    distance = np.linalg.norm(gap[:, [0, 2]], axis=1)
    nearest = int(distance.argmin())
    return world.names[rows[nearest]] if distance[nearest] < 0.25 else _WALL


_HEADINGS = {"MoveAhead": 0.0, "MoveRight": 90.0, "MoveBack": 180.0, "MoveLeft": 270.0}
"""Heading of each action, degrees clockwise from the agent's own."""


def _mover(heading: float) -> Callable[..., None]:
    def move(
        world: World,
        *,
        moveMagnitude: float | None = None,
        objectId: str = "",
        maxAgentsDistance: float = -1.0,
        forceAction: bool = False,
        manualInteract: bool = False,
        allowAgentsToIntersect: bool = False,
        speed: float = 1.0,
        fixedDeltaTime: float | None = None,
        returnToStart: bool = True,
        disableRendering: bool = True,
    ) -> None:
        """Step by moveMagnitude metres (default: gridSize) without turning.

        With ``objectId``, the agent stays within ``maxAgentsDistance`` metres of that object.
        ``manualInteract`` leaves the hand as it is. With ``allowAgentsToIntersect`` other agents
        are no obstacle. All other arguments have no effect: the held object collides with nothing
        here.
        """
        near = (objectId, maxAgentsDistance) if objectId and maxAgentsDistance > 0.0 else None
        _step(world, moveMagnitude, heading, near, manualInteract, allowAgentsToIntersect)

    return move


@action("MoveGlobal")
def move_global(world: World, *, x: float, z: float) -> None:
    """Step by metres along the world's axes without turning."""
    heading = float(np.degrees(np.arctan2(x, z))) - world.agent.rotation
    _step(world, float(np.hypot(x, z)), heading)


for _name, _heading in _HEADINGS.items():
    action(_name)(_mover(_heading))


def _stay_near(world: World, here: np.ndarray, object_id: str, most: float) -> None:
    """Refuse a position (3,) that is farther from an object's box than ``most`` metres."""
    i = world.find(object_id)
    gap = np.clip(here, world.low[i], world.high[i]) - here
    if np.hypot(gap[0], gap[2]) > most:
        raise ActionFailed(f"Agent movement would bring it beyond the max distance of {object_id}.")


def _only_yaw(rotation: Vector | None) -> None:
    if rotation is not None and max(abs(rotation.x), abs(rotation.z)) >= _LEVEL:
        raise ActionFailed(
            "No agents currently can change in pitch or roll. So, you must set "
            f"rotation(x=0, y=yaw, z=0). You gave ({rotation.x:g}, {rotation.y:g}, "
            f"{rotation.z:g}). Consider forceAction=true."
        )


def _not_too_far_up_or_down(horizon: float) -> None:
    low, high = LOOK_LIMITS
    if not low - LOOK_TOLERANCE <= horizon <= high + LOOK_TOLERANCE:
        raise ActionFailed(f"Each horizon must be in [{low:g}:{high:g}]. You gave {horizon:g}.")


def _in_bounds(world: World, there: tuple[float, float, float]) -> None:
    low, high = room_corners(world.scene.name)
    if all(a <= at <= b for a, at, b in zip(low, there, high, strict=True)):
        return
    # Two rooms were published with a start outside their walls; the agent may stay there.
    here = world.agent.position.tolist()
    if max(abs(at - was) for at, was in zip(there, here, strict=True)) > 1e-3:
        raise ActionFailed(
            f"Teleport position ({there[0]:.6f}, {there[1]:.6f}, {there[2]:.6f}) out of scene "
            "bounds! Ignore this by setting forceAction=true. GetReachablePositions lists where "
            "the agent can stand."
        )


@action("Teleport", "TeleportFull")
def teleport(
    world: World,
    *,
    position: Vector | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    rotation: Vector | None = None,
    horizon: float | None = None,
    standing: bool | None = None,
    forceAction: bool = False,
) -> None:
    """Put the agent at a pose. Arguments that are left out keep their values.

    ``forceAction`` waives all conditions except that numbers are within bounds.
    """
    agent = world.agent
    if position is not None:
        x, y, z = position.x, position.y, position.z
    if not forceAction:
        _only_yaw(rotation)
    here = agent.position.tolist()
    teleport_to(
        world,
        (here[0] if x is None else x, here[1] if y is None else y, here[2] if z is None else z),
        agent.rotation if rotation is None else rotation.y % 360.0,
        horizon,
        agent.standing if standing is None else standing,
        force=forceAction,
        moved=any(part is not None for part in (x, y, z)),
    )


def teleport_to(
    world: World,
    there: tuple[float, float, float],
    rotation: float,
    horizon: float | None,
    standing: bool,
    *,
    force: bool,
    moved: bool = True,
) -> None:
    """What ``TeleportFull`` does, with all values given.

    Args:
        there: x, y and z, metres.
        rotation: degrees, 0 to 360.
        horizon: degrees; None for the present one.
        force: whether to waive all conditions except that numbers are within bounds.
        moved: whether the position was given, and is no longer the agent's own.
    """
    agent = world.agent
    x, y, z = there
    if not force:
        _not_too_far_up_or_down(agent.horizon if horizon is None else horizon)
    if max(abs(x), abs(y), abs(z)) > _FARTHEST:
        raise ActionFailed(
            f"({x:g}, {y:g}, {z:g}) is farther than {_FARTHEST:g} m away, beyond every wall."
        )
    if not force:
        if moved:
            _in_bounds(world, there)
        standing_at = world.standing_height
        if abs(y - standing_at) > _HEIGHT_TOLERANCE:
            raise ActionFailed(
                f"Cannot teleport to height {y:.3f}: on the floor the agent's centre is at "
                f"{standing_at:.3f}. Consider using forceAction=true to teleport there anyway."
            )
        if not floor_of(world.scene.name).has(x, z):
            raise ActionFailed(
                f"Cannot teleport to ({x:.3f}, {z:.3f}): {_obstacle(world, np.array(there))} is "
                "there. GetReachablePositions lists where the agent can stand."
            )
        y = standing_at
    world.place_agent(
        Agent(
            position=np.array([x, y, z]),
            rotation=rotation,
            # As AI2-THOR reports it. A forced one may be any number.
            horizon=agent.horizon if horizon is None else remainder(horizon, 360.0),
            standing=standing,
        )
    )
