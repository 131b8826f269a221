"""The state of a world as plain data: how its objects differ from the arranged room, and the
agents.

An episode changes few objects of a room. So the state lists these alone, with the exact bits of
their numbers, and takes some hundred bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import Agent
from er_gym.sim.carrying import Hand, Kept
from er_gym.sim.look import OWN, Chance, Line, Look
from er_gym.sim.space.line_of_sight_builder import recorded_world
from er_gym.sim.waiting import Waiting
from er_gym.sim.world import World

_ARRAYS = (
    *("position", "rotation", "low", "high", "obb", "properties", "states", "openness", "mass"),
    "exists",
)
_LISTS = (
    *("object_ids", "names", "types", "asset_ids", "temperature", "fill_liquid", "parents"),
    *("controlled", "salient_materials"),
)
_TUPLES = frozenset({"parents", "controlled", "salient_materials"})
"""The lists whose entries are tuples, or None."""
_SETS = ("remains", "touched", "_displaced")


def state_of(world: World) -> dict[str, Any]:
    """The state of a world, of numbers, texts, bytes, lists and dictionaries by name.

    It holds in any world of the same scene in the same arrangement (``SetObjectPoses``). Settings
    and third-party cameras are no part of it.
    """
    base = _base(world)
    changed = {
        **{name: _changed_rows(getattr(world, name), getattr(base, name)) for name in _ARRAYS},
        **{name: _changed_entries(getattr(world, name), getattr(base, name)) for name in _LISTS},
    }
    # One agent alone has no number, and nobody waits for it.
    several: dict[str, Any] = {}
    if world.others:
        others = [[number, _plain_waiting(each)] for number, each in world.others.items()]
        several = {"acting": world.acting, "others": others}
    return {
        **several,
        "objects": len(world),
        "changed": {name: rows for name, rows in changed.items() if rows is not None},
        "sets": {name: sorted(getattr(world, name)) for name in _SETS},
        "held": world.held,
        "hand": _plain_hand(world.hand),
        "disabled": [[i, list(rows)] for i, rows in world.disabled.items()],
        "listed": None if world.listed is None else sorted(world.listed),
        "look": None if world.look == OWN else list(astuple(world.look)),
        "chance": list(astuple(world.chance)),
        "unshown": sorted(world.unshown),
        "lines": [list(astuple(line)) for line in world.lines],
        "untouched": world.untouched,
        "agent": _plain_agent(world.agent),
    }


def restore_state(world: World, state: Mapping[str, Any]) -> None:
    """Put a world into a state of :func:`state_of`.

    Raises:
        ValueError: the state is not of this scene in this arrangement.
    """
    base = _base(world)
    count = state["objects"]
    if count < len(base):
        raise ValueError(f"the state has {count} objects, and the room {len(base)}")
    own_base = world.base
    world.restore(base)
    world.base = own_base
    changed: set[int] = set()
    for name, rows in state["changed"].items():
        if name in _ARRAYS:
            setattr(world, name, _with_rows(getattr(world, name), rows, count))
        else:
            setattr(world, name, _with_entries(getattr(world, name), rows, name in _TUPLES))
        changed.update(rows[0])
    if changed:
        world.changed(changed)
    for name in _SETS:
        setattr(world, name, set(state["sets"][name]))
    world.held, world.hand = state["held"], _hand_of(state["hand"])
    world.disabled = {i: tuple(rows) for i, rows in state["disabled"]}
    world.listed = None if state["listed"] is None else frozenset(state["listed"])
    world.untouched = state["untouched"]
    world.look = OWN if state["look"] is None else _look_of(*state["look"])
    world.chance = Chance(*state["chance"])
    world.unshown = frozenset(state["unshown"])
    world.lines = tuple(
        Line(name, tuple(map(_triple, points)), *others) for name, points, *others in state["lines"]
    )
    # The hands are where their objects say, so nothing is carried.
    world.agent, world.acting = _agent_of(state["agent"]), state.get("acting", 0)
    world.wait({number: _waiting_of(*each) for number, each in state.get("others", ())})
    world.cache.state_changed()


def _plain_agent(agent: Agent) -> list[Any]:
    return [*agent.position.tolist(), agent.rotation, agent.horizon, agent.standing]


def _agent_of(plain: Sequence[Any]) -> Agent:
    x, y, z, rotation, horizon, standing = plain
    return Agent(np.array([x, y, z]), rotation, horizon, standing)


def _plain_waiting(other: Waiting) -> list[Any]:
    hand = _plain_hand(other.hand)
    return [_plain_agent(other.agent), other.field_of_view, other.held, hand, other.map_view]


def _waiting_of(
    agent: Sequence[Any], fov: float, held: int, hand: Sequence[Any] | None, map_view: bool
) -> Waiting:
    return Waiting(_agent_of(agent), fov, held, _hand_of(hand), map_view)


def _plain_hand(hand: Hand | None) -> list[Any] | None:
    return None if hand is None else list(astuple(hand))


def _hand_of(plain: Sequence[Any] | None) -> Hand | None:
    if plain is None:
        return None
    shift, turn, heading, kept = plain
    return Hand(
        _triple(shift),
        None if turn is None else _triple(turn),
        heading,
        tuple(Kept(row, *map(_triple, corners)) for row, *corners in kept),
    )


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _look_of(
    materials: int | None, splits: Sequence[str], colors: int | None, light: Sequence[float]
) -> Look:
    return Look(materials, tuple(splits), colors, _triple(light))


def _base(world: World) -> World:
    return world.base or recorded_world(world.scene.name)


def _changed_rows(now: NDArray[Any], before: NDArray[Any]) -> list[Any] | None:
    """The rows that differ and their content, None for none; rows at the end may be new."""
    own, other = _as_bytes(now), _as_bytes(before)
    count = len(before)
    rows = np.flatnonzero((own[:count] != other).any(axis=1)).tolist()
    rows += range(count, len(now))
    return [rows, own[rows].tobytes()] if rows else None


def _with_rows(before: NDArray[Any], rows: Sequence[Any], count: int) -> NDArray[Any]:
    numbers, content = rows
    found = before
    if len(before) < count:
        more = np.zeros((count - len(before), *before.shape[1:]), before.dtype)
        found = np.concatenate([before, more])
    found[numbers] = np.frombuffer(content, before.dtype).reshape(-1, *before.shape[1:])
    return found


def _as_bytes(array: NDArray[Any]) -> NDArray[np.uint8]:
    """(N, B) the bytes of each row: not-a-number equals itself, and -0.0 is not 0.0."""
    return np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1)


def _changed_entries(now: Sequence[Any], before: Sequence[Any]) -> list[Any] | None:
    rows = [i for i, (one, other) in enumerate(zip(now, before, strict=False)) if one != other]
    rows += range(len(before), len(now))
    return [rows, [now[i] for i in rows]] if rows else None


def _with_entries(before: Sequence[Any], rows: Sequence[Any], tuples: bool) -> list[Any]:
    found = list(before)
    for i, entry in zip(*rows, strict=True):
        value = tuple(entry) if tuples and entry is not None else entry
        found[i : i + 1] = [value]  # at the end, this adds it
    return found
