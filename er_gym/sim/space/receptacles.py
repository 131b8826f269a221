"""The receptacles that an object is in, computed from its place."""

from __future__ import annotations

import numpy as np

from er_gym.sim.scene import PROPERTIES
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.families import family
from er_gym.sim.world import World

_FLOOR = [0, 2]
_RECEPTACLE = PROPERTIES.index("receptacle")
_BESIDE = 0.02
"""How far outside its receptacle the middle of an object may be, metres: boxes are rough."""
_SLACK = 0.06
"""How far an object's underside may be off the receptacle's surface, metres."""
_LOW = 0.3
"""Objects do not stand lower on a table or bed than this share of its height."""
_HANGERS = frozenset({"TowelHolder", "HandTowelHolder", "ToiletPaperHanger"})
_CASES = frozenset({"Cabinet", "Drawer", "Fridge", "Microwave", "Safe"})
"""Objects on top of these types, or sticking out of them, are not in them."""


def receptacles_of(world: World, i: int) -> tuple[int, ...]:
    """The receptacles that object i is in at its present place, innermost first.

    The innermost one is the smallest receptacle at whose surface the object stands. If that can be
    picked up, as a plate can, its own receptacles follow. For 97 % of the pickupable objects the
    first one is a receptacle that AI2-THOR's own record names (see docs/fidelity.md).
    """
    within = {i, *world.inside(i)}
    found = []
    # Skip receptacles that are not near on the floor plan.
    low, high = world.low[:, _FLOOR], world.high[:, _FLOOR]
    near = ((low[i] <= high + _SLACK) & (high[i] >= low - _SLACK)).all(axis=1)
    for r in np.flatnonzero(near & world.exists & world.properties[:, _RECEPTACLE]).tolist():
        if r not in within:
            fit = _fit(world, r, i)
            if fit is not None:
                west, _, south = world.low[r].tolist()
                east, _, north = world.high[r].tolist()
                area = (east - west) * (north - south)
                found.append((fit, world.types[r] == "Floor", area, r))
    if not found:
        return ()
    innermost = min(found)[-1]
    around = world.parents[innermost] if world.has(innermost, "pickupable") else ()
    return (innermost, *(r for r in around if r not in within))


def _fit(world: World, r: int, i: int) -> int | None:
    """How well object i fits in or on receptacle r: 0 well, 1 perhaps, None not at all."""
    kind = world.types[r]
    if kind in _HANGERS:
        low, high = world.low[r], world.high[r]
        near = (world.low[i] <= high + _SLACK).all() and (world.high[i] >= low - _SLACK).all()
        return 0 if near else None
    if not _over(world, r, i):
        return None
    bottom, ceiling = float(world.low[r, 1]), float(world.high[r, 1])
    underside, top = float(world.low[i, 1]), float(world.high[i, 1])
    if kind == "Floor":
        return 0 if abs(underside - ceiling) <= _SLACK else None
    stand = family(kind, world.has(r, "pickupable")).stand
    tall = ceiling - bottom
    if stand is None:
        most = ceiling + _SLACK
        if kind in _CASES:
            most = ceiling - _BESIDE if top <= ceiling + _SLACK else -np.inf
        elif kind == "Shelf":
            # A shelf is a board and the air above it, up to the next shelf's board.
            most = bottom + max(_SLACK, tall / 2)
        return 0 if bottom - _SLACK <= underside <= most else None
    if abs(underside - (bottom + stand * tall)) <= _SLACK:
        return 0
    return 1 if bottom + _LOW * tall <= underside <= ceiling + _SLACK else None


def _over(world: World, r: int, i: int) -> bool:
    """Whether the middle of object i is over receptacle r. A counter may be bent."""
    (x, _, z), (to_x, _, to_z) = world.low[i].tolist(), world.high[i].tolist()
    x, z = (x + to_x) / 2, (z + to_z) / 2
    if world.types[r] == "CounterTop":
        boxes = solid_of(world, r).boxes.tolist()
    else:
        boxes = [(world.low[r].tolist(), world.high[r].tolist())]
    return any(
        low[0] - _BESIDE <= x <= high[0] + _BESIDE and low[2] - _BESIDE <= z <= high[2] + _BESIDE
        for low, high in boxes
    )
