"""Where AI2-THOR puts the agent when a scene is loaded."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from er_gym.sim.scene import HOUSES

START_POSES = Path(__file__).parent / "data" / "start_poses.json"
"""Built by :mod:`er_gym.sim.data.build_start_poses`."""


class StartPose(NamedTuple):
    """A pose on the floor: metres, and degrees clockwise from +z.

    Attributes:
        lift: how much higher the agent stands than its height over the scene's Floor, metres.
    """

    x: float
    z: float
    rotation: float
    lift: float = 0.0


def start_pose(scene_name: str) -> StartPose:
    """The pose after ``Initialize`` in a scene; the agent stands and looks level."""
    recorded = _table().get(scene_name)
    if recorded is not None:
        return recorded
    shell = HOUSES[scene_name].shell
    assert shell is not None
    return StartPose(*shell.start)


@cache
def _table() -> Mapping[str, StartPose]:
    rows = json.loads(START_POSES.read_text(encoding="utf-8"))
    return {name: StartPose(*row) for name, row in rows.items()}
