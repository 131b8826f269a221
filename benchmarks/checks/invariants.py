"""Invariants of AI2-THOR metadata after any action, as pure functions.

Each takes the metadata of one event and yields a sentence for each violation. They read only
metadata, so they work with either engine.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Any

import msgpack  # type: ignore[import-untyped]  # what ai2thor sends metadata with
import numpy as np
from numpy.typing import NDArray

Metadata = Mapping[str, Any]

_PART = re.compile(r"(.+)\|(?:\w+Sliced|EggCracked)_\d+")
"""The id of a slice or a cracked egg begins with the id of the whole object."""
_OPENS_ELSEWHERE = frozenset({"Toilet"})
"""Receptacles whose lid does not cover their contents: objects stand on a toilet's cistern."""
_TOLERANCE = 0.08
"""How far the agent may be from the nearest point of a 5 cm grid of the floor, metres."""


def _by_id(metadata: Metadata) -> dict[str, Metadata]:
    return {entry["objectId"]: entry for entry in metadata["objects"]}


def ids_are_unique(metadata: Metadata) -> Iterator[str]:
    """No two objects share an id."""
    counts = Counter(entry["objectId"] for entry in metadata["objects"])
    for object_id, count in counts.items():
        if count > 1:
            yield f"{object_id} is listed {count} times"


def contents_agree(metadata: Metadata) -> Iterator[str]:
    """parentReceptacles and receptacleObjectIds agree, and name only objects that exist."""
    objects = _by_id(metadata)
    up = {(i, p) for i, entry in objects.items() for p in entry["parentReceptacles"] or ()}
    down = {(c, i) for i, entry in objects.items() for c in entry["receptacleObjectIds"] or ()}
    for thing, receptacle in sorted(up - down):
        yield f"{thing} says it is in {receptacle}, which does not list it"
    for thing, receptacle in sorted(down - up):
        yield f"{receptacle} lists {thing}, which does not say so"
    for thing, receptacle in sorted(up | down):
        if thing not in objects or receptacle not in objects:
            yield f"{thing} is in {receptacle}, and one of them does not exist"


def nothing_contains_itself(metadata: Metadata) -> Iterator[str]:
    """No receptacle contains itself, directly or through others."""
    parents = {i: entry["parentReceptacles"] or () for i, entry in _by_id(metadata).items()}
    done: set[str] = set()
    for start in parents:
        path: list[str] = []
        todo = [(start, 0)]
        while todo:
            at, depth = todo.pop()
            del path[depth:]
            if at in path:
                yield f"{at} is in itself by way of {' in '.join(path[path.index(at) :])}"
                break
            path.append(at)
            if at not in done:
                todo.extend((parent, depth + 1) for parent in parents.get(at, ()))
        done.add(start)


def hand_agrees(metadata: Metadata) -> Iterator[str]:
    """The hand holds at most one object; isPickedUp says which, and no receptacle contains it."""
    held = [entry["objectId"] for entry in metadata["inventoryObjects"]]
    if len(held) > 1:
        yield f"the hand holds {' and '.join(held)}"
    yield from held_are_marked(metadata, held)


def held_are_marked(metadata: Metadata, held: Sequence[str]) -> Iterator[str]:
    """isPickedUp says what all hands hold, and no receptacle contains it.

    Args:
        held: the ids of what any agent holds.
    """
    marked = [entry["objectId"] for entry in metadata["objects"] if entry["isPickedUp"]]
    if sorted(held) != sorted(marked):
        yield f"the hand holds {list(held)}, and isPickedUp says {marked}"
    objects = _by_id(metadata)
    for object_id in held:
        if object_id in objects and objects[object_id]["parentReceptacles"]:
            yield f"{object_id} is in hand and in {objects[object_id]['parentReceptacles'][0]}"


def closed_things_hide_their_contents(metadata: Metadata) -> Iterator[str]:
    """Objects in a closed receptacle are neither visible nor interactable."""
    objects = _by_id(metadata)
    for object_id, entry in objects.items():
        if not (entry["visible"] or entry["isInteractable"]):
            continue
        seen: set[str] = set()
        todo = list(entry["parentReceptacles"] or ())
        while todo:
            parent = todo.pop()
            if parent in seen or parent not in objects:
                continue
            seen.add(parent)
            around = objects[parent]
            opens = around["openable"] and around["objectType"] not in _OPENS_ELSEWHERE
            if opens and not around["isOpen"]:
                yield f"{object_id} can be seen in {parent}, which is closed"
            todo.extend(around["parentReceptacles"] or ())


def wholes_are_gone(metadata: Metadata) -> Iterator[str]:
    """If there are slices, the whole object is listed as sliced, and has no place."""
    objects = _by_id(metadata)
    for object_id in objects:
        part = _PART.fullmatch(object_id)
        whole = objects.get(part.group(1)) if part else None
        if whole is None:
            continue
        if not (whole["isSliced"] or whole["isBroken"]):
            yield f"{whole['objectId']} is still whole beside {object_id}"
        for name in ("visible", "isInteractable", "isPickedUp", "parentReceptacles"):
            if whole[name]:
                yield f"{whole['objectId']} is cut up, and its {name} is {whole[name]}"


def values_are_plain(metadata: Metadata) -> Iterator[str]:
    """All values are plain and can be serialised: no arrays, NumPy numbers or tuples."""
    try:
        msgpack.packb(dict(metadata), strict_types=True)
    except TypeError as error:
        yield f"the metadata hold a value that is not plain: {error}"


def _numbers(entry: Metadata) -> Iterator[float]:
    yield from (entry["distance"], entry["openness"], entry["mass"])
    box = entry["axisAlignedBoundingBox"]
    for vector in (entry["position"], entry["rotation"], box["center"], box["size"]):
        yield from vector.values()
    oriented = entry["objectOrientedBoundingBox"]
    for boxes in (box, oriented) if oriented else (box,):
        for corner in boxes["cornerPoints"]:
            yield from corner


def numbers_are_finite(metadata: Metadata) -> Iterator[str]:
    """No number is NaN or infinite."""
    for entry in metadata["objects"]:
        # A sum is finite if and only if all its parts are, unless absurdly large parts overflow.
        if not isfinite(sum(_numbers(entry))):
            yield f"{entry['objectId']} has a number that is NaN or infinite"
    agent = metadata["agent"]
    numbers = [agent["cameraHorizon"], *agent["position"].values(), *agent["rotation"].values()]
    if not isfinite(sum(numbers)):
        yield f"the agent's pose is {numbers}"


def failures_say_why(metadata: Metadata) -> Iterator[str]:
    """errorMessage is empty if and only if the last action succeeded."""
    if metadata["lastActionSuccess"] is not (metadata["errorMessage"] == ""):
        yield (
            f"lastActionSuccess is {metadata['lastActionSuccess']} and errorMessage is "
            f"{metadata['errorMessage']!r}"
        )


INVARIANTS: tuple[Callable[[Metadata], Iterator[str]], ...] = (
    ids_are_unique,
    contents_agree,
    nothing_contains_itself,
    hand_agrees,
    closed_things_hide_their_contents,
    wholes_are_gone,
    values_are_plain,
    numbers_are_finite,
    failures_say_why,
)
"""The invariants of a single event."""


def stands_on_the_floor(metadata: Metadata, floor: NDArray[np.float64]) -> Iterator[str]:
    """The agent stands on the floor.

    Args:
        floor: (P, 2) x and z in metres, the scene's reachable positions on a 5 cm grid.
    """
    here = metadata["agent"]["position"]
    away = float(np.hypot(floor[:, 0] - here["x"], floor[:, 1] - here["z"]).min())
    if not away <= _TOLERANCE:
        yield f"the agent is {away:.3f} m off the floor, at ({here['x']:.3f}, {here['z']:.3f})"


def a_refusal_changed_nothing(before: Metadata, after: Metadata) -> Iterator[str]:
    """A failed action has not changed the agent or any object."""
    if after["lastActionSuccess"]:
        return
    if before["agent"] != after["agent"]:
        yield "a refused action moved the agent"
    if before["objects"] != after["objects"]:
        old = _by_id(before)
        changed = [i for i, entry in _by_id(after).items() if old.get(i) != entry]
        yield f"a refused action changed {', '.join(changed) or 'which objects there are'}"


def broken(metadata: Metadata) -> list[str]:
    """All violations of :data:`INVARIANTS`."""
    return [problem for invariant in INVARIANTS for problem in invariant(metadata)]


def floor_of(positions: list[dict[str, float]]) -> NDArray[np.float64]:
    """(P, 2) x and z of the ``actionReturn`` of GetReachablePositions."""
    return np.array([(p["x"], p["z"]) for p in positions]).reshape(-1, 2)
