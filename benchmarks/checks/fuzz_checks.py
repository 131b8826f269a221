"""The fuzz's checks after every action, besides :mod:`benchmarks.checks.invariants`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from math import hypot, inf, isfinite
from typing import Any

import msgpack  # type: ignore[import-untyped]  # what the player sends metadata with
import numpy as np
from numpy.typing import NDArray

from benchmarks.checks.invariants import (
    INVARIANTS,
    Metadata,
    a_refusal_changed_nothing,
    floor_of,
    hand_agrees,
    held_are_marked,
    stands_on_the_floor,
    values_are_plain,
)
from er_gym.sim.crew import as_agent
from er_gym.sim.object_metadata import objects as objects_of
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.walkable_floor import standing_places
from er_gym.sim.world import World

Pictures = Sequence[NDArray[Any]]

LONGEST_MESSAGE = 2000
OF_THE_ACTION = frozenset(
    {"lastAction", "lastActionSuccess", "errorMessage", "errorCode", "actionReturn", "colors"}
)
"""The metadata's fields about the last action; all others are the state of the world."""
QUESTIONS = frozenset(
    {
        *("Pass", "Done", "PausePhysicsAutoSim", "UnpausePhysicsAutoSim", "AdvancePhysicsStep"),
        *("GetScenesInBuild", "GetObjectInFrame", "GetReachablePositions", "GetInteractablePoses"),
        *("GetCoordinateFromRaycast", "GetSpawnCoordinatesAboveReceptacle", "GetShortestPath"),
        *("GetShortestPathToPoint", "ObjectNavExpertAction", "SetRandomSeed"),
        *("RandomizeColors", "RandomizeMaterials", "RandomizeLighting"),
        *("ResetMaterials", "ResetColors", "ResetLighting", "ChangeColorOfMaterials"),
        *("HideObject", "UnhideObject", "HideAllObjects", "UnhideAllObjects", "VisualizePath"),
        *("HideVisualizedPath", "VisualizeGrid", "HighlightObject", "NoOp", "TogglePhysics"),
        *("GetObjectMetadata", "GetVisibleObjects", "ObjectsVisibleFromPositions", "BBoxDistance"),
        *("PerformRaycast", "GetObjectHitFromRaycast", "CheckWhatObjectOn", "VisibleRange"),
        *("Get2DSemanticHulls", "WorldToViewportPoint", "PositionsFromWhichItemIsInteractable"),
        *("CheckUnobstructedPathBetweenObjectCenters", "ApproxPercentScreenObjectOccupies"),
        "ChangeQuality",
    }
)
"""Actions that change nothing, whether they succeed or fail."""
PLACING = frozenset({"Reset", "Initialize", "CreateHouse"})
"""Actions that place agents which do not act."""
_STEPS = frozenset({"MoveAhead", "MoveBack", "MoveLeft", "MoveRight", "MoveGlobal"})
_BODIES = 0.4
"""The least distance between two agents, metres."""
_TELEPORTS = ("Teleport", "TeleportFull")
_FLOOR_STEP = 0.05
_ODD_TIMES = 25
"""The expensive checks run once in this many actions."""
_OF_THE_OBJECTS = [
    invariant for invariant in INVARIANTS if invariant not in (values_are_plain, hand_agrees)
]


@lru_cache(maxsize=128)
def floor(scene: str, step: float = _FLOOR_STEP) -> tuple[dict[str, float], ...]:
    """Where the agent can stand in a scene, on all pieces of its floor."""
    y = World.load(load_scene(scene), Settings()).standing_height
    return tuple({"x": x, "y": y, "z": z} for x, z in standing_places(scene, step).tolist())


@lru_cache(maxsize=128)
def floor_points(scene: str) -> NDArray[np.float64]:
    """(P, 2) x and z of :func:`floor`, metres."""
    return floor_of(list(floor(scene)))


def scene_of(metadata: Metadata) -> str:
    """The name of the scene, as ``Reset`` takes it."""
    return str(metadata["sceneName"]).removesuffix("_physics")


def failure_has_a_message(metadata: Metadata) -> Iterator[str]:
    """A refused action has an error message of one readable line, and returns nothing."""
    message = metadata["errorMessage"]
    if len(message) > LONGEST_MESSAGE:
        yield f"errorMessage has {len(message)} characters: {message[:60]!r}…"
    if len(message.splitlines()) > 1:
        yield f"errorMessage has {len(message.splitlines())} lines: {message[:200]!r}"
    told = message if metadata["lastAction"] == "GetObjectInFrame" else None
    if not metadata["lastActionSuccess"] and metadata["actionReturn"] not in (None, told):
        yield "a refused action returned something"


def nothing_else_changed(before: Metadata, after: Metadata) -> Iterator[str]:
    """The metadata have changed only in the fields about the last action."""
    for name in sorted({*before, *after} - OF_THE_ACTION):
        if name not in before or name not in after or before[name] != after[name]:
            yield f"{after['lastAction']}, which changes nothing, changed {name}"


def can_be_serialised(metadata: Metadata) -> Iterator[str]:
    """The metadata can be packed as msgpack and as JSON: plain types, no NaN, no infinity."""
    try:
        _packed(metadata)
    except (TypeError, ValueError, OverflowError) as error:
        yield f"the metadata cannot be packed: {type(error).__name__}: {error}"
    try:
        json.dumps(metadata, allow_nan=False)
    except (TypeError, ValueError) as error:
        yield (
            f"the metadata are not valid JSON: {error}, at "
            f"{', '.join(_endless('', metadata)) or '?'}"
        )


def _packed(metadata: Metadata) -> bytes:
    """Pack as the player does, replacing invalid Unicode; tuples and NumPy numbers are refused."""
    packed: bytes = msgpack.packb(metadata, strict_types=True, unicode_errors="replace")
    return packed


def _endless(path: str, value: Any) -> Iterator[str]:
    """The paths of numbers that are NaN or infinite."""
    if isinstance(value, float) and not isfinite(value):
        yield f"{path} = {value}"
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from _endless(f"{path}.{name}", part)
    elif isinstance(value, (list, tuple)):
        for number, part in enumerate(value):
            yield from _endless(f"{path}[{number}]", part)


def pictures_fit(pictures: Pictures, metadata: Metadata) -> Iterator[str]:
    """Every picture has the size in the metadata, and no pixel is NaN. Depth may be infinite where
    the wall is nearer than the near plane.
    """
    size = metadata["screenHeight"], metadata["screenWidth"]
    for picture in pictures:
        if picture.shape[:2] != size:
            yield f"a picture is {picture.shape[:2]}, and the metadata say {size}"
        if np.isnan(picture).any():
            yield "a picture has a pixel that is NaN"


def cache_is_consistent(world: World, metadata: Metadata) -> Iterator[str]:
    """The engine's cached state equals the state that it computes without the cache."""
    untouched = world.untouched
    world.untouched = False  # an unchanged world has the entries of its scene
    world.forget()
    anew = objects_of(world)
    world.untouched = untouched
    for old, new in zip(metadata["objects"], anew, strict=True):
        for name in new:
            if old[name] != new[name]:
                yield f"{new['objectId']}.{name} is {new[name]}, but the cache has {old[name]}"


class RoomChecker:
    """Checks every event that one agent of a room is told, in order."""

    def __init__(self) -> None:
        self.seen = 0
        self._before: dict[str, Any] | None = None
        self._settings: object = None
        self._kept: tuple[dict[str, Any], bytes] | None = None

    def sees(
        self, request: Mapping[str, Any], metadata: dict[str, Any], pictures: Pictures, world: World
    ) -> Iterator[str]:
        """All problems after this request."""
        before, self._before = self._before, metadata
        self.seen += 1
        yield from failure_has_a_message(metadata)
        yield from pictures_fit(pictures, metadata)
        if before is None or before["objects"] != metadata["objects"]:
            # Otherwise they passed the checks the last time.
            for invariant in _OF_THE_OBJECTS:
                yield from invariant(metadata)
            yield from values_are_plain({"objects": metadata["objects"]})
        yield from can_be_serialised({**metadata, "objects": []})
        if before is not None:
            yield from self._compared(request, before, metadata, world)
        if self.seen % _ODD_TIMES == 0:
            yield from can_be_serialised(metadata)
            yield from cache_is_consistent(world, metadata)
            yield from self._kept_metadata_unchanged(metadata)
        self._settings = world.settings

    def watches(
        self, acted: Metadata, metadata: dict[str, Any], pictures: Pictures, world: World
    ) -> Iterator[str]:
        """All problems of what the agent is told after another agent's action.

        Args:
            acted: what the agent that acted is told.
        """
        before, self._before = self._before, metadata
        self._settings = world.settings
        yield from pictures_fit(pictures, metadata)
        if before is None or before["objects"] != metadata["objects"]:
            for invariant in _OF_THE_OBJECTS:
                yield from invariant(metadata)
        yield from can_be_serialised({**metadata, "objects": []})
        if before is None:
            return
        name, number = acted["lastAction"], metadata["agentId"]
        if not acted["lastActionSuccess"] or name in QUESTIONS:
            yield from nothing_else_changed(before, {**metadata, "lastAction": name})
        if before["agent"] != metadata["agent"] and name not in PLACING:
            yield f"agent {number} did not act, and now is {metadata['agent']}"

    @property
    def before(self) -> Metadata | None:
        """What the agent was told last."""
        return self._before

    def _compared(
        self, request: Mapping[str, Any], before: Metadata, after: Metadata, world: World
    ) -> Iterator[str]:
        name = request.get("action")
        if not after["lastActionSuccess"] or (isinstance(name, str) and name in QUESTIONS):
            yield from a_refusal_changed_nothing(before, after)
            yield from nothing_else_changed(before, after)
            if self._settings != world.settings:
                yield f"{name}, which changes nothing, changed {self._settings}"
        # A forced teleport may end in a wall.
        forced = name in _TELEPORTS and "forceAction" in request
        if before["agent"]["position"] != after["agent"]["position"] and not forced:
            yield from stands_on_the_floor(after, floor_points(world.scene.name))

    def _kept_metadata_unchanged(self, metadata: dict[str, Any]) -> Iterator[str]:
        """Metadata that a caller has kept do not change later."""
        if self._kept is not None and _packed(self._kept[0]) != self._kept[1]:
            yield f"the metadata of {_ODD_TIMES} actions ago have changed since"
        self._kept = metadata, _packed(metadata)


class CompanyChecker:
    """Checks what all agents of one room are told, in order."""

    def __init__(self) -> None:
        self._agents: dict[int, RoomChecker] = {}

    def sees(
        self,
        request: Mapping[str, Any],
        told: Sequence[tuple[dict[str, Any], Pictures]],
        world: World,
    ) -> Iterator[str]:
        """All problems after this request.

        Args:
            told: the metadata and the pictures of each agent, first of the one that acted.
        """
        yield from hands_agree([metadata for metadata, _ in told])
        agents = {metadata["agentId"] for metadata, _ in told}
        self._agents = {k: self._agents.get(k, RoomChecker()) for k in agents}
        (acted, pictures), *others = told
        checker = self._agents[acted["agentId"]]
        before = checker.before
        yield from checker.sees(request, acted, pictures, world)
        if before is not None and "allowAgentsToIntersect" not in request:
            yield from keeps_apart(before, acted, [metadata for metadata, _ in others])
        for metadata, shown in others:
            number = metadata["agentId"]
            own = as_agent(world, number)
            yield from self._agents[number].watches(acted, metadata, shown, own)


def hands_agree(told: Sequence[Metadata]) -> Iterator[str]:
    """Each hand holds at most one object, and isPickedUp says which are in any."""
    held = [entry["objectId"] for metadata in told for entry in metadata["inventoryObjects"]]
    for metadata in told:
        if len(metadata["inventoryObjects"]) > 1:
            yield f"agent {metadata['agentId']} holds {metadata['inventoryObjects']}"
        yield from held_are_marked(metadata, held)


def keeps_apart(before: Metadata, after: Metadata, others: Sequence[Metadata]) -> Iterator[str]:
    """No step brings an agent nearer to another than their bodies allow."""
    if after["lastAction"] not in _STEPS or not after["lastActionSuccess"]:
        return
    for other in others:
        was, now = (_apart(each, other) for each in (before, after))
        if now < min(_BODIES, was) - 1e-5:
            yield f"a step ends {now:.3f} m from agent {other['agentId']}, and began at {was:.3f}"


def _apart(one: Metadata, other: Metadata) -> float:
    """The distance between two agents, metres; infinite on different heights."""
    (x, y, z), (to_x, to_y, to_z) = (each["agent"]["position"].values() for each in (one, other))
    return hypot(to_x - x, to_z - z) if abs(to_y - y) < 1.8 else inf
