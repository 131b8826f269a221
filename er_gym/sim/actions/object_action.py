"""Actions on an object that is named by its id or by a point of the agent's picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import radians, tan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.actions.conversion import kind_of
from er_gym.sim.actions.registry import Parameter, Run, Signature, add_signature, parameters_of
from er_gym.sim.errors import ActionFailed
from er_gym.sim.render.view import draw, object_at
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.world import World


def pointed_at(world: World, x: float, y: float) -> str:
    """The id of the object at a point of the agent's picture.

    Args:
        x, y: 0 to 1, from the left and from the top.

    Raises:
        ActionFailed: the point is outside the picture, or shows the room and no object.
    """
    if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
        raise ActionFailed(f"x/y must be in [0:1], from the upper left corner, not ({x:g}, {y:g}).")
    found = object_at(world, x, y)
    if found is None:
        raise ActionFailed(f"No SimObject found at (x: {x:g}, y: {y:g}), only the room.")
    return found


def shown_at(world: World, x: float, y: float) -> NDArray[np.float64]:
    """(3,) metres: the point of the room at a point of the agent's picture.

    Args:
        x, y: 0 to 1, from the left and from the top.
    """
    settings, cameras = world.settings, world.cameras
    world.settings, world.cameras = replace(settings, render_depth=True), ()
    try:
        depth = draw(world).depth
    finally:
        world.settings, world.cameras = settings, cameras
    assert depth is not None  # depth was requested
    column = min(int(x * settings.width), settings.width - 1)
    row = min(int(y * settings.height), settings.height - 1)
    half = tan(radians(settings.field_of_view / 2))
    aspect = settings.width / settings.height
    ahead = np.array([(2 * x - 1) * half * aspect, (1 - 2 * y) * half, 1.0])
    heading = unity_rotation(np.array([world.agent.horizon, world.agent.rotation, 0.0]))
    return np.asarray(world.agent.camera + heading @ (ahead * float(depth[row, column])))


def object_action(*names: str, server_action: bool = False) -> Callable[[Run], Run]:
    """Register a handler with ``objectId`` so that it can also be called with ``x, y`` instead.

    With named parameters the action gets two signatures, and a call with both is invalid. An action
    that takes a server action uses the point if the request has no ``objectId``; the default point
    is the upper left corner.
    """

    def register(run: Run) -> Run:
        own = parameters_of(run)
        others = {name: each for name, each in own.items() if name != "objectId"}
        point = {axis: Parameter(axis, float, kind_of(float)) for axis in "xy"}
        anywhere = {axis: replace(each, default=0.0) for axis, each in point.items()}
        either = {"objectId": replace(own["objectId"], default=None), **anywhere, **others}
        for name in names:
            if server_action:
                add_signature(Signature(name, _at_either(run), either, server_action=True))
            else:
                add_signature(Signature(name, run, own))
                add_signature(Signature(name, _at_point(run), {**point, **others}))
        return run

    return register


def _at_point(run: Run) -> Run:
    def at_point(world: World, *, x: float, y: float, **others: Any) -> Any:
        return run(world, objectId=pointed_at(world, x, y), **others)

    return at_point


def _at_either(run: Run) -> Run:
    def at_either(
        world: World, *, objectId: str | None = None, x: float = 0.0, y: float = 0.0, **others: Any
    ) -> Any:
        named = pointed_at(world, x, y) if objectId is None else objectId
        return run(world, objectId=named, **others)

    return at_either
