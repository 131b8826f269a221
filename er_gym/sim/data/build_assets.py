"""Build ``assets.json``: the size and the abilities of every asset that a house can be made of.

The sizes and abilities come from the asset database of ``procthor`` (see
:mod:`er_gym.sim.data.build_scenes`). It says nothing of masses and materials, and nothing of the
drawers, cabinets, shelves, basins and faucets that are part of an asset. Those come from the
recorded scenes: from the first recorded instance of the asset, in its own frame.

    python -m er_gym.sim.data.build_assets             # download procthor, rewrite the table
    python -m er_gym.sim.data.build_assets WHEEL_OR_DIR
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from er_gym.sim.data.build_scenes import WHEELS, Source, download_wheel, open_source
from er_gym.sim.scene import PROPERTIES, SCENE_NAMES, Scene, load_scene

OUTPUT = Path(__file__).parent / "assets.json"
DATABASE = "procthor/databases/asset-database.json"

_PROPERTY_OF = {
    "Receptacle": "receptacle",
    "ObjectSpecificReceptacle": "receptacle",
    "CanPickup": "pickupable",
    "Moveable": "moveable",
    "CanOpen": "openable",
    "CanToggleOnOff": "toggleable",
    "CanBreak": "breakable",
    "CanBeSliced": "sliceable",
    "CanBeCooked": "cookable",
    "CanBeDirty": "dirtyable",
    "CanBeFilled": "canFillWithLiquid",
    "CanBeUsedUp": "canBeUsedUp",
    "isHeatSource": "isHeatSource",
    "isColdSource": "isColdSource",
}
"""The database's names of properties and AI2-THOR's."""
_PARTS = {
    "Dresser": ("Drawer", "Cabinet"),
    "SideTable": ("Drawer", "Shelf"),
    "Desk": ("Drawer", "Cabinet"),
    "TVStand": ("Shelf",),
    "ShelvingUnit": ("Shelf", "Drawer", "Cabinet"),
    "Sink": ("SinkBasin", "Faucet"),
}
"""The types whose assets have parts, and the types of these."""
_OUTSIDE = {"Faucet": (0.1, 0.5)}
"""How far the middle of a part may be outside of the box, to the sides and upwards, metres."""
_RUB = 0.03


def rows(database: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, dict[str, Any]]:
    """By object type and asset id: ``size`` (w, h, d) in metres, ``has`` and ``parts``."""
    built_in = parts_of_assets()
    found: dict[str, dict[str, Any]] = {}
    for kind, assets in sorted(database.items()):
        for asset in assets:
            named = [asset.get("primaryProperty"), *asset.get("secondaryProperties", ())]
            has = {_PROPERTY_OF[name] for name in named if name in _PROPERTY_OF}
            entry: dict[str, Any] = {
                "size": [round(asset["boundingBox"][axis], 4) for axis in "xyz"],
                "has": " ".join(p for p in PROPERTIES if p in has),
            }
            if asset["assetId"] in built_in:
                entry["parts"] = built_in[asset["assetId"]]
            found.setdefault(kind, {})[asset["assetId"]] = entry
    return found


def parts_of_assets() -> dict[str, list[dict[str, Any]]]:
    """The parts of each asset that is in the record: type, middle, size and abilities."""
    found: dict[str, list[dict[str, Any]]] = {}
    for name in SCENE_NAMES:
        scene = load_scene(name)
        for i, kind in enumerate(scene.types):
            asset = scene.asset_ids[i]
            if kind in _PARTS and asset and asset not in found:
                parts = list(_parts(scene, i))
                if parts:
                    found[asset] = parts
    return found


def _parts(scene: Scene, i: int) -> Iterator[dict[str, Any]]:
    quarters = round(scene.rotation[i, 1] / 90.0)
    if abs(scene.rotation[i, 1] - 90.0 * quarters) > 1.0:
        return
    cos, sin = ((1, 0), (0, 1), (-1, 0), (0, -1))[quarters % 4]
    half = scene.aabb_size[i] / 2
    for k, kind in enumerate(scene.types):
        if kind not in _PARTS[scene.types[i]]:
            continue
        aside, above = _OUTSIDE.get(kind, (_RUB, _RUB))
        away = scene.aabb_center[k] - scene.aabb_center[i]
        if (np.abs(away) > half + np.array([aside, above, aside])).any():
            continue
        x, y, z = away
        w, h, d = scene.aabb_size[k]
        if quarters % 2:
            w, d = d, w
        yield {
            "type": kind,
            "middle": [round(float(v), 3) for v in (cos * x - sin * z, y, sin * x + cos * z)],
            "size": [round(float(v), 3) for v in (w, h, d)],
            "has": " ".join(
                p for p, yes in zip(PROPERTIES, scene.properties[k], strict=True) if yes
            ),
        }


def of_types() -> dict[str, dict[str, Any]]:
    """By object type: the ``mass`` in kilograms that is usual in the record, and the materials."""
    masses: dict[str, list[float]] = {}
    materials: dict[str, tuple[str, ...]] = {}
    for name in SCENE_NAMES:
        scene = load_scene(name)
        for i, kind in enumerate(scene.types):
            masses.setdefault(kind, []).append(float(scene.mass[i]))
            made_of = scene.salient_materials[i]
            if made_of:
                materials.setdefault(kind, made_of)
    return {
        kind: {"mass": round(median(all_of_it), 3), "materials": list(materials.get(kind, ()))}
        for kind, all_of_it in sorted(masses.items())
    }


def build(procthor: Source) -> str:
    """Write the table; returns a line that says what is in it."""
    found = rows(json.loads((procthor / DATABASE).read_text(encoding="utf-8")))
    lines = [
        f"{json.dumps(kind)}: {{\n"
        + ",\n".join(f"{json.dumps(name)}: {json.dumps(row)}" for name, row in assets.items())
        + "}"
        for kind, assets in found.items()
    ]
    usual = [f"{json.dumps(kind)}: {json.dumps(row)}" for kind, row in of_types().items()]
    text = '{"types": {\n' + ",\n".join(usual) + '},\n"assets": {\n' + ",\n".join(lines) + "}}\n"
    OUTPUT.write_text(text, encoding="utf-8")
    assets = sum(map(len, found.values()))
    return f"{assets} assets of {len(found)} types, {OUTPUT.stat().st_size / 1e6:.2f} MB"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(build(open_source(Path(sys.argv[1]))))
    else:
        with tempfile.TemporaryDirectory() as folder:
            print(build(open_source(download_wheel(*WHEELS["procthor"], folder=Path(folder)))))
