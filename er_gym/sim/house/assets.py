"""The assets that a house is made of: their sizes, abilities and parts."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from er_gym.sim.house.schema import HouseError

ASSETS = Path(__file__).parents[1] / "data" / "assets.json"
"""Built by :mod:`er_gym.sim.data.build_assets`."""

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """An object that is part of an asset, such as a drawer.

    Attributes:
        middle: of its box, from the middle of the asset's box, in the asset's frame, metres.
        size: width, height and depth, metres.
    """

    type: str
    middle: Triple
    size: Triple
    has: frozenset[str]


@dataclass(frozen=True)
class Asset:
    """An asset.

    Attributes:
        id: AI2-THOR's ``assetId``.
        type: AI2-THOR's object type.
        size: width, height and depth of its box, metres; it faces +z.
        has: the properties of :data:`er_gym.sim.scene.PROPERTIES` that it has.
        mass: kilograms; 0 if it can be neither picked up nor moved.
        materials: AI2-THOR's salient materials.
    """

    id: str
    type: str
    size: Triple
    has: frozenset[str]
    mass: float
    materials: tuple[str, ...]
    parts: tuple[Part, ...]


@cache
def assets() -> Mapping[str, Asset]:
    """All assets by id, type by type."""
    table = json.loads(ASSETS.read_text(encoding="utf-8"))
    return {
        name: _asset(name, kind, row, table["types"].get(kind, {}))
        for kind, rows in table["assets"].items()
        for name, row in rows.items()
    }


@cache
def assets_of_type(kind: str) -> tuple[Asset, ...]:
    """The assets of an object type, in the order of the table."""
    return tuple(each for each in assets().values() if each.type == kind)


def asset(name: str) -> Asset:
    """An asset by its id.

    Raises:
        HouseError: there is none.
    """
    found = assets().get(name)
    if found is None:
        raise HouseError(
            f"no asset {name!r:.80} is in the table of {len(assets())} assets; it has those of "
            "ProcTHOR's database, such as Fridge_1 and Apple_27"
        )
    return found


def _asset(name: str, kind: str, row: Mapping[str, Any], usual: Mapping[str, Any]) -> Asset:
    has = frozenset(row["has"].split())
    parts = tuple(
        Part(
            each["type"],
            _triple(each["middle"]),
            _triple(each["size"]),
            frozenset(each["has"].split()),
        )
        for each in row.get("parts", ())
    )
    loose = bool(has & {"pickupable", "moveable"})
    mass = max(float(usual.get("mass", 0.0)), 0.1) if loose else 0.0
    materials = tuple(usual.get("materials", ())) if loose else ()
    return Asset(name, kind, _triple(row["size"]), has, mass, materials, parts)


def _triple(values: list[float]) -> Triple:
    x, y, z = values
    return x, y, z


@cache
def known_types() -> frozenset[str]:
    """The object types of recorded rooms."""
    return frozenset(json.loads((ASSETS.parent / "object_types.json").read_text(encoding="utf-8")))
