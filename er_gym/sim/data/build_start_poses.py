"""Build ``start_poses.json``: the agent's pose after ``Initialize`` in each scene.

The input is a JSON file with AI2-THOR 5's pose for scenes by name, at gridSize 0.25::

    {"poses": {"FloorPlan1": {"x": -1.0, "y": 0.901, "z": 1.0, "rotation": 270.0, "horizon": 0.0}}}

The poses come from the metadata published with Embodied-Reasoner (see NOTICE). These lack
FloorPlan30, and two rooms have the pose of another room: see ``_OUR_OWN``. Run this after
:mod:`er_gym.sim.data.build_scenes`::

    python -m er_gym.sim.data.build_start_poses POSES.json
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from er_gym.sim.agent import AGENT_HEIGHT
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.start_pose import START_POSES, StartPose

_OUR_OWN = {
    "FloorPlan30": StartPose(2.25, 0.25, 270.0),  # beside the kitchen island, facing it
    "FloorPlan410": StartPose(-2.25, 3.25, 180.0),  # before the mirror
    "FloorPlan411": StartPose(-0.75, 2.0, 90.0),  # published for FloorPlan410
}
"""The poses published for FloorPlan410 and 411 belong to the rooms after them. All objects seen
from the first pose are in FloorPlan411, and the second pose is FloorPlan412's. Both are outside the
walls of the rooms that they were published for."""
_ROUNDING = 1e-4
"""The poses are rounded to a tenth of a millimetre."""

Pose = Mapping[str, float]


def start_pose_of(scene_name: str, pose: Pose) -> StartPose:
    """A row of the table.

    Raises:
        ValueError: the agent does not look level.
    """
    if abs(pose["horizon"]) > _ROUNDING:
        raise ValueError(f"{scene_name}: horizon {pose['horizon']}, but every start is level")
    scene = load_scene(scene_name)
    floor = scene.types.index("Floor")
    ground = scene.aabb_center[floor, 1] + scene.aabb_size[floor, 1] / 2
    lift = pose["y"] - float(ground) - AGENT_HEIGHT
    lift = round(lift, 4) if abs(lift) > _ROUNDING else 0.0
    return StartPose(pose["x"], pose["z"], pose["rotation"], lift)


def build(poses: Mapping[str, Pose]) -> dict[str, StartPose]:
    """The table, in the order of the scenes.

    Raises:
        KeyError: a scene has no pose.
    """
    return {name: _OUR_OWN.get(name) or start_pose_of(name, poses[name]) for name in SCENE_NAMES}


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("poses", type=Path, metavar="POSES.json")
    given = parser.parse_args(arguments)
    table = build(json.loads(given.poses.read_text(encoding="utf-8"))["poses"])
    rows = (f'"{name}": {json.dumps(row)}' for name, row in table.items())
    START_POSES.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")
    print(f"{START_POSES.name}: {len(table)} scenes")


if __name__ == "__main__":
    main()
