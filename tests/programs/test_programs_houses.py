"""A program that gives AI2-THOR a house of ProcTHOR's kind, and walks through every door."""

from __future__ import annotations

import json

from houses_by_hand import DOORS, three_rooms

PROGRAM = """
import json, sys
from ai2thor.controller import Controller

house, doors = json.load(open(sys.argv[1]))
controller = Controller(scene="Procedural", gridSize=0.25, width=300, height=300)
event = controller.reset(scene=house)
print(event.metadata["sceneName"], event.frame.shape)
y = event.metadata["agent"]["position"]["y"]
pose = {**house["metadata"]["agent"], "horizon": 0, "standing": True}
event = controller.step("TeleportFull", **pose)
assert event, event.metadata["errorMessage"]
for x, z in doors:
    here = controller.last_event.metadata["agent"]["position"]
    for side in (-0.75, 0.75):
        # On foot: along the shortest path to one side of the door, then to the other.
        path = controller.step(
            "GetShortestPathToPoint", target={"x": x + side, "y": y, "z": z}
        ).metadata["actionReturn"]["corners"]
        for corner in path[1:]:
            event = controller.step("Teleport", position={**corner, "y": y})
            assert event, event.metadata["errorMessage"]
    at = event.metadata["agent"]["position"]
    print(round(at["x"] - x, 2), round(at["z"] - z, 2))
controller.stop()
"""


def test_a_house_is_walked_through_every_door(user, tmp_path):
    path = tmp_path / "house.json"
    path.write_text(json.dumps([three_rooms(), DOORS]))
    code, out, err = user.try_to("-c", PROGRAM, str(path))
    assert code == 0, err
    assert out.splitlines() == ["Procedural (300, 300, 3)", *["0.75 0.0"] * len(DOORS)]
