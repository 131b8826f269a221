"""The appearance of an object: everything that its drawn shape depends on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.palette import Palette, palette
from er_gym.sim.render.patch import Colour
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import Scene, scene_category
from er_gym.sim.space.recorded_surfaces import recorded_surfaces
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.built_in import Box, built_in
from er_gym.sim.world import World
from er_gym.sim.world_cache import ObjectCacheKey


@dataclass(frozen=True)
class Appearance:
    """The appearance of one object. It is hashable, so that its mesh can be cached.

    Attributes:
        kind: AI2-THOR's object type.
        asset: its asset id, "" where there is none.
        scene: the scene's name.
        room: "kitchens", "living_rooms", "bedrooms" or "bathrooms".
        size: width (x), height (y) and depth (z) of its upright box, metres.
        height: of its underside above the floor, metres.
        palette: the scene's colours.
        openness: 0 closed to 1 open.
        on: whether it is switched on.
        filled: its liquid ("water", "coffee", "wine"), "" if it is empty.
        dirty, cooked, sliced, broken, used_up: its states.
        parts: the boxes of its solid in the mesh's frame, low and high corners, metres. Those of a
            counter are the rectangles of its top.
        surface: height above its underside at which things stand on it, metres; None if unknown.
        boards: heights of shelves above its underside, metres.
        built_in: type and box, in the mesh's frame, of the objects that are built into it.
        face: direction of a knob's face in the mesh's frame; None if unknown.
    """

    kind: str
    asset: str
    scene: str
    room: str
    size: tuple[float, float, float]
    height: float
    palette: Palette
    openness: float = 0.0
    on: bool = False
    filled: str = ""
    dirty: bool = False
    cooked: bool = False
    sliced: bool = False
    broken: bool = False
    used_up: bool = False
    parts: tuple[Box, ...] = ()
    surface: float | None = None
    boards: tuple[float, ...] = ()
    built_in: tuple[tuple[str, Box], ...] = ()
    face: tuple[float, float, float] | None = None

    def random(self) -> np.random.Generator:
        """A random generator that is the same for an object in every run and in every state."""
        key = f"{self.kind}|{self.asset or self.scene}"
        return np.random.default_rng(
            int.from_bytes(blake2b(key.encode(), digest_size=8).digest(), "big")
        )

    def pick(self, *colours: Colour) -> Colour:
        """One of several colours, always the same for this object."""
        return colours[int(self.random().integers(len(colours)))]


_APPEARANCES: ObjectCacheKey[Appearance] = ObjectCacheKey("appearance", in_snapshots=False)
_ON_THE_FLOOR = 0.1
_ALWAYS = 0.004
"""The least thickness of a drawn object, metres."""
_LEVEL = 0.05
"""An axle is level if it rises less than this share of its length."""


@lru_cache(maxsize=128)
def _recorded(scene: Scene) -> dict[int, Appearance]:
    """The appearances of objects that have not changed yet, filled by :func:`appearance_of`."""
    return {}


def appearance_of(world: World, i: int) -> Appearance:
    """The appearance of object i in its present state; kept until the object changes."""
    changed = i in world.touched or i >= len(world.scene)
    kept = world.cache.of_objects(_APPEARANCES) if changed else _recorded(world.scene)
    found = kept.get(i)
    if found is None:
        found = kept[i] = compute_appearance(world, i)
    return found


def compute_appearance(world: World, i: int) -> Appearance:
    """The appearance of object i, without the cache."""
    scene, solid = world.scene.name, solid_of(world, i)
    size = np.maximum(np.ptp(solid.upright.reshape(-1, 3), axis=0), _ALWAYS)
    underside = solid.upright[:, 0, 1].min()
    ground = world.high[next(world.of_type("Floor")), 1]
    return Appearance(
        kind=world.types[i],
        asset=world.asset_ids[i],
        scene=scene,
        room=scene_category(scene),
        size=_triple(size),
        height=_height(world, i, float(solid.middle[1] + underside - ground)),
        palette=palette(scene),
        openness=round(float(world.openness[i]), 2) if world.state(i, "isOpen") else 0.0,
        on=_is_on(world, i),
        filled=(world.fill_liquid[i] or "water") if world.state(i, "isFilledWithLiquid") else "",
        dirty=world.state(i, "isDirty"),
        cooked=world.state(i, "isCooked"),
        sliced=world.state(i, "isSliced"),
        broken=world.state(i, "isBroken"),
        used_up=world.state(i, "isUsedUp"),
        parts=_parts(solid.upright, underside),
        surface=_surface(world, i),
        boards=_boards(world, i, float(solid.middle[1] + underside)),
        built_in=built_in(scene, i),
        face=_face(world, i, solid.yaw) if world.types[i] == "StoveKnob" else None,
    )


def _height(world: World, i: int, height: float) -> float:
    """Height above the floor, metres. A pickupable object looks the same anywhere off the floor."""
    if world.has(i, "pickupable"):
        return 0.0 if height < _ON_THE_FLOOR else 1.0
    return round(height, 2)


def _is_on(world: World, i: int) -> bool:
    """Whether object i is switched on, itself or by the knob that controls it."""
    if world.types[i] != "StoveBurner":
        return world.state(i, "isToggled")
    knobs = world.of_type("StoveKnob")
    return any(i in (world.controlled[k] or ()) and world.state(k, "isToggled") for k in knobs)


def _face(world: World, i: int, yaw: float) -> tuple[float, float, float]:
    """The direction of the face of knob i, before the turn by ``yaw``.

    A knob is recorded with its y along its axle, in either direction. Its face points up or, if the
    axle is level, to where the agent can stand.
    """
    axle = unity_rotation(world.rotation[i]) @ (0.0, 1.0, 0.0)
    towards = np.array([0.0, 1.0, 0.0])
    if abs(axle[1]) < _LEVEL:
        away = world.scene.reachable - (world.low[i] + world.high[i])[::2] / 2
        towards[:] = np.insert(away[np.hypot(*away.T).argmin()], 1, 0.0)
    face = axle if axle @ towards > 0.0 else -axle
    return _triple((face @ unity_rotation((0.0, yaw, 0.0))).round(2) + 0.0)


def _triple(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.round(3).tolist()
    return x, y, z


def _parts(upright: NDArray[np.float64], underside: float) -> tuple[Box, ...]:
    """The parts of the solid, counted from the middle of the underside."""
    lifted = upright - np.array([0.0, underside, 0.0])
    return tuple((_triple(low), _triple(high)) for low, high in lifted)


def _surface(world: World, i: int) -> float | None:
    height = recorded_surfaces(world.scene.name).get(i) if i < len(world.scene) else None
    return None if height is None else round(float(height), 3)


def _boards(world: World, i: int, underside: float) -> tuple[float, ...]:
    """Heights of the Shelf objects inside object i, above its underside."""
    if world.types[i] not in _CASES_OF_SHELVES:
        return ()
    low, high = world.low[i] - 0.05, world.high[i] + 0.05
    found = {
        round(float(world.low[k, 1]) - underside, 3)
        for k in world.of_type("Shelf")
        if (low <= (world.low[k] + world.high[k]) / 2).all()
        and ((world.low[k] + world.high[k]) / 2 <= high).all()
    }
    return tuple(sorted(found))


_CASES_OF_SHELVES = frozenset(
    {"ShelvingUnit", "Desk", "TVStand", "Dresser", "SideTable", "Cabinet"}
)
