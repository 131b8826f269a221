"""A program that starts where published navigation tasks start, as their harnesses do."""

from __future__ import annotations

import json

LEAST = 0.9
"""The share of Unity's reachable positions that have to be accepted."""
PROGRAM = """
import json, sys
from ai2thor.controller import Controller

positions = json.load(open(sys.argv[1]))["positions"]
controller = Controller(width=64, height=48, gridSize=0.1, headless=True, scene="FloorPlan1")
accepted = {}
for scene in sorted(positions)[::8]:
    event = controller.reset(scene)
    height = event.metadata["agent"]["position"]["y"]
    reached = 0
    for x, z in positions[scene]:
        event = controller.step(
            action="Teleport", position={"x": x, "y": height, "z": z}, rotation={"y": 90}
        )
        at = event.metadata["agent"]["position"]
        reached += bool(event) and abs(at["x"] - x) < 0.01 and abs(at["z"] - z) < 0.01
    accepted[scene] = [reached, len(positions[scene])]
controller.stop()
print(json.dumps(accepted))
"""


def test_programs_can_start_at_published_positions(user, shared_data):
    """2,311 positions that Unity gave as reachable, in 80 scenes; here every eighth scene."""
    path = shared_data / "unity_positions_dev.json"
    code, out, err = user.try_to("-c", PROGRAM, str(path))
    assert code == 0, err
    accepted = json.loads(out)
    assert len(accepted) == 10
    reached, given = (sum(counts) for counts in zip(*accepted.values(), strict=True))
    assert reached >= LEAST * given, accepted
