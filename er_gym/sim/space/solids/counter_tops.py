"""Bent counters: the part of their box that the agent's body leaves free."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene
from er_gym.sim.space.recorded_floor import recorded_cells
from er_gym.sim.space.solids.built_in import Front, Rectangle, fronts

_CELL = 0.05
_AGENT_RADIUS = 0.2
_NEIGHBOURS = frozenset({"Fridge", "DiningTable", "SideTable", "Dresser", "Sofa", "ArmChair"})
_OVERHANG = 0.04
"""How far a counter juts out over the fronts under it, metres."""
_OPENS = 0.35
"""The counter ends at this distance in front of a front, metres."""
_IN_LINE, _GAP = 0.06, 0.8
"""How far apart cabinets of one row may be, ahead and to the side, metres."""
_ARM = 0.65
"""Depth of the arms of a counter of a house, metres."""
_NARROW = 0.15
"""Narrower strips of a counter are dropped, metres."""


@lru_cache(maxsize=512)
def rectangles(scene_name: str, i: int) -> NDArray[np.float64]:
    """(R, 2, 2) corners x, z of the rectangles that make up the box of recorded counter i.

    Three areas are cut from the box: the area that the agent's body covers as it walks, that of
    other large furniture, and that right in front of cabinets and drawers. The largest rectangle of
    the rest is taken, then the largest of what remains, and so on. If nothing remains, the whole
    box is returned: the agent walks under it.
    """
    scene = load_scene(scene_name)
    low = (scene.aabb_center[i] - scene.aabb_size[i] / 2)[[0, 2]]
    high = low + scene.aabb_size[i][[0, 2]]
    if scene.shell is not None:
        return _arms(scene.asset_ids[i], low, high, round(float(scene.rotation[i, 1]) / 90.0) % 4)
    first, left = _not_swept(scene_name, low, high)
    for k, kind in enumerate(scene.types):
        if kind in _NEIGHBOURS:
            reach = scene.aabb_size[k][[0, 2]] / 2
            edges = scene.aabb_center[k][[0, 2]] + np.array([-reach, reach])
            (x0, z0), (x1, z1) = np.clip(np.ceil((edges - first) / _CELL), 0, None).astype(int)
            left[x0:x1, z0:z1] = False
    for x0, z0, x1, z1 in _before_fronts(scene_name, i, low, high):
        a, b = np.clip(np.ceil((np.array([[x0, z0], [x1, z1]]) - first) / _CELL), 0, None).astype(
            int
        )
        left[a[0] : b[0], a[1] : b[1]] = False
    found = []
    while True:
        x0, x1, z0, z1 = _largest_rectangle(left)
        edges = first + _CELL * (np.array([(x0, z0), (x1, z1)]) - 0.5)
        corners = np.clip(edges, low, high)
        if (corners[1] - corners[0] < np.minimum(_NARROW, high - low)).any():
            break
        found.append(corners)
        left[x0:x1, z0:z1] = False
    boxes = np.array(found or [np.array([low, high])])
    boxes.setflags(write=False)
    return boxes


def _arms(
    asset: str, low: NDArray[np.float64], high: NDArray[np.float64], quarters: int
) -> NDArray[np.float64]:
    """(R, 2, 2) the arms of a counter of a house, which the name of its asset tells.

    One runs along the back. An L has one on its right, and a C on both sides.
    """
    shape = next((name for name in ("_L_", "_C_") if name in asset), "")
    sides = {"": (), "_L_": (1,), "_C_": (1, 3)}[shape]  # quarter turns from the front
    found = [_strip(low, high, (quarters + side) % 4) for side in (2, *sides)] if shape else []
    boxes = np.array(found or [np.array([low, high])])
    boxes.setflags(write=False)
    return boxes


def _strip(low: NDArray[np.float64], high: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """(2, 2) the strip along one side of a rectangle: 0 is +z, 1 is +x."""
    corners, axis = np.array([low, high]), (side + 1) % 2
    if side < 2:
        corners[0, axis] = max(low[axis], high[axis] - _ARM)
    else:
        corners[1, axis] = min(high[axis], low[axis] + _ARM)
    return corners


def _before_fronts(
    scene_name: str, i: int, low: NDArray[np.float64], high: NDArray[np.float64]
) -> Iterator[Rectangle]:
    """The areas where doors and drawers under counter i open, unless its box ends there anyway."""
    rows: dict[tuple[int, int], list[Front]] = {}
    for front in fronts(scene_name, i):
        rows.setdefault((front.axis, front.sign), []).append(front)
    for (axis, sign), row in rows.items():
        # A row of cabinets has gaps for an oven or a dishwasher.
        spans: list[list[float]] = []
        for front in sorted(row, key=lambda f: (round(f.at, 1), f.low)):
            last = spans[-1] if spans else [np.inf, 0.0, 0.0]
            if abs(front.at - last[0]) < _IN_LINE and front.low - last[2] < _GAP:
                last[2] = max(last[2], front.high)
                last[0] = sign * max(sign * front.at, sign * last[0])
            else:
                spans.append([front.at, front.low, front.high])
        for at, first, last_end in spans:
            near, far = at + sign * _OVERHANG, at + sign * _OPENS
            end = high[axis] if sign > 0 else low[axis]
            if sign * (end - far) > 0.0:
                across = sorted((near, far))
                ends = [0.0] * 4
                ends[axis], ends[axis + 2] = across
                ends[1 - axis], ends[3 - axis] = first, last_end
                yield ends[0], ends[1], ends[2], ends[3]


def _not_swept(
    scene_name: str, low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The centre (2,) of the first cell over an area, metres, and whether each of its cells is
    free."""
    swept = recorded_cells(scene_name, _CELL).grown(_AGENT_RADIUS)
    origin = swept.origin
    from_cell = np.round((low - origin) / _CELL).astype(int)
    to_cell = np.round((high - origin) / _CELL).astype(int) + 1
    free = np.ones(to_cell - from_cell, dtype=bool)
    inner_low, inner_high = np.maximum(from_cell, 0), np.minimum(to_cell, swept.on.shape)
    if (inner_low < inner_high).all():
        (x0, z0), (x1, z1) = inner_low, inner_high
        dx, dz = inner_low - from_cell
        free[dx : dx + x1 - x0, dz : dz + z1 - z0] = ~swept.on[x0:x1, z0:z1]
    return origin + from_cell * _CELL, free


def _largest_rectangle(cells: NDArray[np.bool_]) -> tuple[int, int, int, int]:
    """The rectangle x0, x1, z0, z1 (half-open) with the most true cells.

    In each row, every column has a run of true cells that ends there. The runs form a histogram,
    and the largest rectangle under it is found with a stack of columns of rising height.
    """
    best, area = (0, 0, 0, 0), 0
    runs = [0] * cells.shape[1]
    for x, row in enumerate(cells.tolist()):
        runs = [run + 1 if true else 0 for run, true in zip(runs, row, strict=True)]
        rising: list[tuple[int, int]] = []  # (first column, height)
        for z, run in enumerate([*runs, 0]):
            start = z
            while rising and rising[-1][1] >= run:
                start, height = rising.pop()
                if height * (z - start) > area:
                    area = height * (z - start)
                    best = (x + 1 - height, x + 1, start, z)
            rising.append((start, run))
    return best
