"""A recorded iTHOR scene: everything that is known about one room, as read-only arrays.

The tables hold figures read from AI2-THOR itself. :mod:`er_gym.sim.data.build_scenes` builds them,
and loading them needs no Unity build. Lengths are metres, angles degrees, positions in AI2-THOR's
world frame (x right, y up, z forward, left-handed; rotation clockwise seen from above).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.shell import Shell

PROPERTIES = (
    "receptacle",
    "pickupable",
    "moveable",
    "openable",
    "toggleable",
    "breakable",
    "sliceable",
    "cookable",
    "dirtyable",
    "canFillWithLiquid",
    "canBeUsedUp",
    "isHeatSource",
    "isColdSource",
)
"""The properties of an object, by AI2-THOR's names: the columns of ``Scene.properties``."""

STATES = (
    "isOpen",
    "isToggled",
    "isBroken",
    "isSliced",
    "isCooked",
    "isDirty",
    "isFilledWithLiquid",
    "isUsedUp",
)
"""The states in which an object can start, by AI2-THOR's names: the columns of ``Scene.states``."""

SCENE_NUMBERS: Mapping[str, range] = {
    "kitchens": range(1, 31),
    "living_rooms": range(201, 231),
    "bedrooms": range(301, 331),
    "bathrooms": range(401, 431),
}
"""The FloorPlan numbers of each kind of room, in AI2-THOR's order."""

SCENE_NAMES = tuple(f"FloorPlan{n}" for numbers in SCENE_NUMBERS.values() for n in numbers)
"""The names of the 120 iTHOR scenes, in AI2-THOR's order."""


def scene_category(scene_name: str) -> str:
    """ "kitchens", "living_rooms", "bedrooms" or "bathrooms": a key of :data:`SCENE_NUMBERS`.

    A house has the kind of its first room.
    """
    house = HOUSES.get(scene_name)
    if house is not None and house.shell is not None:
        return house.shell.category
    number = int(scene_name.removeprefix("FloorPlan"))
    return next(category for category, numbers in SCENE_NUMBERS.items() if number in numbers)


_GRID = 0.25  # metres between the recorded agent positions
_SCENES = Path(__file__).parent / "data" / "scenes"


class UnknownSceneError(ValueError):
    """No packaged scene has the given name."""

    def __init__(self, name: str) -> None:
        kinds = ", ".join(
            f"FloorPlan{numbers[0]}-{numbers[-1]} ({kind.replace('_', ' ')})"
            for kind, numbers in SCENE_NUMBERS.items()
        )
        super().__init__(f"unknown scene {name!r:.200}: choose one of {kinds}")


class OpenablePose(NamedTuple):
    """An agent pose from which an object can be opened: metres and degrees.

    ``rotation`` is the agent's yaw, clockwise from +z; ``horizon`` is positive looking down.
    """

    x: float
    z: float
    rotation: float
    horizon: float


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """One iTHOR scene as AI2-THOR recorded it: N objects, in the recorded order.

    All arrays are read-only. Values are kept as recorded, oddities included: a rotation may be
    360 or -0, an id spells a zero coordinate ``+00.00`` or ``00.00``, and three objects have an
    ``openness`` of 1 with ``isOpen`` false.

    Attributes:
        name: such as ``"FloorPlan1"``.
        object_ids: N unique AI2-THOR ids, ``"Apple|-00.47|+01.15|+00.48"``. An id has the
            coordinates at which the object was authored; physics may have settled it elsewhere.
        names: N names in the Unity scene, unique too.
        types: N object types.
        asset_ids: N names of the asset drawn, ``""`` where the record has none.
        position, rotation: (N, 3) float64, the object's pivot and its Euler angles (see
            :func:`er_gym.sim.rotation.unity_rotation`).
        aabb_center, aabb_size: (N, 3) float64, the box aligned with the world's axes.
        obb: (N, 4, 3) float64, the box aligned with the object's own axes, in the object's own
            frame: corner 0 relative to the pivot, then the edges along x, y and z that lead away
            from corner 0. Edges are signed, and in AI2-THOR's record some are off their axis by a
            millimetre. NaN for an object that can neither be picked up nor moved, since AI2-THOR
            records no such box for it.
        properties: (N, len(PROPERTIES)) bool.
        states: (N, len(STATES)) bool.
        openness: (N,) float64, 0 closed to 1 open.
        mass: (N,) float64, kilograms; 0 for fixed objects.
        temperature: N of ``"RoomTemp"``, ``"Cold"``, ``"Hot"``.
        salient_materials: N tuples such as ``("Metal", "Plastic")``, None where none is recorded.
        parents: per object the indices of the receptacles it lies in, as recorded; often empty.
        controlled: per object the indices of the objects that it switches (a StoveKnob switches its
            StoveBurner), None for an object that cannot be toggled.
        reachable: (P, 2) float64, the x and z of each place on the 0.25 m grid where the agent can
            stand, sorted by z, then x.
        openable_poses: for some objects, by index, a reachable pose from which the agent can open
            the object or use it as a receptacle. Not every openable object has one.
        shell: the rooms and walls of a house, None for a recorded room.
    """

    name: str
    object_ids: tuple[str, ...]
    names: tuple[str, ...]
    types: tuple[str, ...]
    asset_ids: tuple[str, ...]
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    aabb_center: NDArray[np.float64]
    aabb_size: NDArray[np.float64]
    obb: NDArray[np.float64]
    properties: NDArray[np.bool_]
    states: NDArray[np.bool_]
    openness: NDArray[np.float64]
    mass: NDArray[np.float64]
    temperature: tuple[str, ...]
    salient_materials: tuple[tuple[str, ...] | None, ...]
    parents: tuple[tuple[int, ...], ...]
    controlled: tuple[tuple[int, ...] | None, ...]
    reachable: NDArray[np.float64]
    openable_poses: Mapping[int, OpenablePose]
    shell: Shell | None = None

    def __post_init__(self) -> None:
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)

    def __len__(self) -> int:
        """The number of objects, N."""
        return len(self.object_ids)

    def __repr__(self) -> str:
        return f"Scene({self.name!r}, {len(self)} objects)"


HOUSES: WeakValueDictionary[str, Scene] = WeakValueDictionary()
"""The houses that are in use, by the names of their scenes (:mod:`er_gym.sim.house`)."""


def load_scene(name: str) -> Scene:
    """Load a packaged scene, or a house that is in use; loading it again gives the same object.

    Args:
        name: ``"FloorPlan1"``, or AI2-THOR's file name for the same room, ``"FloorPlan1_physics"``.

    Raises:
        UnknownSceneError: ``name`` is not one of :data:`SCENE_NAMES`.
    """
    plain = name.removesuffix("_physics")
    if plain in SCENE_NAMES:
        return _load_packaged(plain)
    house = HOUSES.get(name)
    if house is None:
        raise UnknownSceneError(name)
    return house


@cache
def _load_packaged(name: str) -> Scene:
    return read_scene(scene_file(name))


def scene_file(name: str) -> Path:
    """The file of a packaged scene, one of :data:`SCENE_NAMES`."""
    return _SCENES / f"{name}.npz"


def write_scene(path: Path, scene: Scene) -> None:
    """Write a scene as one compressed ``.npz``. The same numpy version writes the same bytes.

    Vectors are stored as float32, which is what Unity computes with: no recorded value changes. A
    text column is one block of UTF-8 with a line per object, which loads faster than an array of
    strings.
    """
    vectors = np.stack([scene.position, scene.rotation, scene.aabb_center, scene.aabb_size], axis=1)
    parents, parent_counts = _flatten(scene.parents)
    controlled, controlled_counts = _flatten(scene.controlled)
    poses = [
        (index, round(pose.x / _GRID), round(pose.z / _GRID), pose.rotation, pose.horizon)
        for index, pose in scene.openable_poses.items()
    ]
    np.savez_compressed(
        path,
        name=_join([scene.name]),
        object_ids=_join(scene.object_ids),
        names=_join(scene.names),
        types=_join(scene.types),
        asset_ids=_join(scene.asset_ids),
        temperature=_join(scene.temperature),
        salient_materials=_join([",".join(m or ()) for m in scene.salient_materials]),
        vectors=np.concatenate([vectors, scene.obb], axis=1).astype(np.float32),
        scalars=np.stack([scene.openness, scene.mass]).astype(np.float32),
        flags=np.concatenate([scene.properties, scene.states], axis=1),
        parents=parents,
        parent_counts=parent_counts,
        controlled=controlled,
        controlled_counts=controlled_counts,
        reachable=np.round(scene.reachable / _GRID).astype(np.int16),
        openable_poses=np.array(poses, dtype=np.int16).reshape(-1, 5),
    )


def read_scene(path: Path) -> Scene:
    """Read a file that :func:`write_scene` wrote."""
    with np.load(path) as archive:
        stored = {key: archive[key] for key in archive.files}
    vectors = stored["vectors"].astype(np.float64)
    position, rotation, aabb_center, aabb_size = vectors[:, :4].swapaxes(0, 1).copy()
    openness, mass = stored["scalars"].astype(np.float64)
    properties, states = np.split(stored["flags"], [len(PROPERTIES)], axis=1)
    parents = _unflatten(stored["parents"], stored["parent_counts"])
    return Scene(
        name=_split(stored["name"])[0],
        object_ids=_split(stored["object_ids"]),
        names=_split(stored["names"]),
        types=_split(stored["types"]),
        asset_ids=_split(stored["asset_ids"]),
        position=position,
        rotation=rotation,
        aabb_center=aabb_center,
        aabb_size=aabb_size,
        obb=vectors[:, 4:].copy(),
        properties=properties,
        states=states,
        openness=openness,
        mass=mass,
        temperature=_split(stored["temperature"]),
        salient_materials=tuple(
            tuple(line.split(",")) if line else None for line in _split(stored["salient_materials"])
        ),
        parents=tuple(indices or () for indices in parents),
        controlled=_unflatten(stored["controlled"], stored["controlled_counts"]),
        reachable=stored["reachable"] * _GRID,
        openable_poses={
            index: OpenablePose(x * _GRID, z * _GRID, float(rotation), float(horizon))
            for index, x, z, rotation, horizon in stored["openable_poses"].tolist()
        },
    )


def _join(column: Sequence[str]) -> NDArray[np.uint8]:
    """A text column as bytes, a line per entry."""
    return np.frombuffer("\n".join(column).encode(), dtype=np.uint8)


def _split(block: NDArray[np.uint8]) -> tuple[str, ...]:
    """Undo :func:`_join`."""
    return tuple(block.tobytes().decode().split("\n"))


def _flatten(column: Sequence[tuple[int, ...] | None]) -> tuple[NDArray[np.int16], ...]:
    """A column of index tuples as all indices in one row, and each tuple's length, -1 for None."""
    indices = [index for entry in column for index in entry or ()]
    counts = [-1 if entry is None else len(entry) for entry in column]
    return np.array(indices, dtype=np.int16), np.array(counts, dtype=np.int16)


def _unflatten(
    indices: NDArray[np.int16], counts: NDArray[np.int16]
) -> tuple[tuple[int, ...] | None, ...]:
    """Undo :func:`_flatten`."""
    flat = iter(indices.tolist())
    return tuple(None if n < 0 else tuple(islice(flat, n)) for n in counts.tolist())
