"""Build ``object_types.json``: every object type of the 120 scenes and what its instances can do.

Run after :mod:`er_gym.sim.data.build_scenes`: ``python -m er_gym.sim.data.build_object_types``.
"""

from __future__ import annotations

import json
from pathlib import Path

from er_gym.sim.actions.state_change import parts_of
from er_gym.sim.scene import PROPERTIES, SCENE_NAMES, load_scene

OUTPUT = Path(__file__).parent / "object_types.json"


def object_types() -> dict[str, list[str]]:
    """The properties that any instance of each object type has; both are in a fixed order."""
    found: dict[str, set[str]] = {}
    for name in SCENE_NAMES:
        scene = load_scene(name)
        for i, kind in enumerate(scene.types):
            has = found.setdefault(kind, set())
            has.update(p for p, yes in zip(PROPERTIES, scene.properties[i], strict=True) if yes)
    for kind in sorted(found):
        if "sliceable" in found[kind]:
            part, cookable = parts_of(kind)
            found[part] = {"pickupable", *(["cookable"] if cookable else [])}
    return {kind: [p for p in PROPERTIES if p in found[kind]] for kind in sorted(found)}


if __name__ == "__main__":
    OUTPUT.write_text(json.dumps(object_types(), indent=0) + "\n")
    print(f"{OUTPUT.name}: {len(object_types())} types")
