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
                area = float(np.prod((world.high[r] - world.low[r])[_FLOOR]))
                found.append((fit, world.types[r] == "Floor", area, r))
    if not found:
        return ()
    innermost = min(found)[-1]
    around = world.parents[innermost] if world.has(innermost, "pickupable") else ()
    return (innermost, *(r for r in around if r not in within))


def _fit(world: World, r: int, i: int) -> int | None:
    """How well object i fits in or on receptacle r: 0 well, 1 perhaps, None not at all."""
    kind = world.types[r]
    low, high = world.low[r], world.high[r]
    underside, top = world.low[i, 1], world.high[i, 1]
    if kind in _HANGERS:
        near = (world.low[i] <= high + _SLACK).all() and (world.high[i] >= low - _SLACK).all()
        return 0 if near else None
    if not _over(world, r, i):
        return None
    if kind == "Floor":
        return 0 if abs(underside - high[1]) <= _SLACK else None
    stand = family(kind, world.has(r, "pickupable")).stand
    tall = high[1] - low[1]
    if stand is None:
        ceiling = high[1] + _SLACK
        if kind in _CASES:
            ceiling = high[1] - _BESIDE if top <= high[1] + _SLACK else -np.inf
        elif kind == "Shelf":
            # A shelf is a board and the air above it, up to the next shelf's board.
            ceiling = low[1] + max(_SLACK, tall / 2)
        return 0 if low[1] - _SLACK <= underside <= ceiling else None
    if abs(underside - (low[1] + stand * tall)) <= _SLACK:
        return 0
    return 1 if low[1] + _LOW * tall <= underside <= high[1] + _SLACK else None


def _over(world: World, r: int, i: int) -> bool:
    """Whether the middle of object i is over receptacle r. A counter may be bent."""
    middle = ((world.low[i] + world.high[i]) / 2)[_FLOOR]
    if world.types[r] == "CounterTop":
        low, high = solid_of(world, r).boxes[:, :, _FLOOR].swapaxes(0, 1)
    else:
        low, high = world.low[None, r, _FLOOR], world.high[None, r, _FLOOR]
    return bool(((low - _BESIDE <= middle) & (middle <= high + _BESIDE)).all(axis=1).any())
