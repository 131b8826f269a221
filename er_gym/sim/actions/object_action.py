"""Actions on an object that is named by its id or by a point of the agent's picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.actions.conversion import kind_of
from er_gym.sim.actions.registry import Parameter, Run, Signature, add_signature, parameters_of
from er_gym.sim.errors import ActionFailed
from er_gym.sim.render.view import seen_at
from er_gym.sim.space.solid_rays import entry
from er_gym.sim.world import World

_COLLIDER = 0.05
"""The most that a collider lies before the drawn surface, metres along the view."""


def pointed_at(world: World, x: float, y: float) -> str:
    """The id of the object at a point of the agent's picture.

    Args:
        x, y: 0 to 1, from the left and from the top.

    Raises:
        ActionFailed: the point is outside the picture, or shows the room and no object.
    """
    if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
        raise ActionFailed(f"x/y must be in [0:1], from the upper left corner, not ({x:g}, {y:g}).")
    row, _, _ = seen_at(world, x, y)
    if row is None:
        raise ActionFailed(f"No SimObject found at (x: {x:g}, y: {y:g}), only the room.")
    return world.object_ids[row]


def shown_at(world: World, x: float, y: float) -> NDArray[np.float64]:
    """(3,) metres: the point of the room at a point of the agent's picture.

    AI2-THOR's ray stops at an object's colliders, which have neither grooves nor panels that lie a
    little back. So where the object's box begins just before the drawn surface, the box counts.

    Args:
        x, y: 0 to 1, from the left and from the top.
    """
    row, depth, camera = seen_at(world, x, y)
    start, way = camera.ray(x, y)
    if row is not None:
        box = entry(world, row, start, way)
        if depth - _COLLIDER <= box < depth:
            depth = box
    return np.asarray(start + way * depth)


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
