"""The same scene graph drawn by OpenGL, if a driver with EGL is installed (Mesa's works)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from er_gym.sim.render.panda import RenderDeviceError, use_device
from er_gym.thor import make_controller

_DRAW = """
import sys
import numpy as np
from er_gym.sim.render import panda
from er_gym.sim.render.panda import RenderDeviceError, use_device
from tests.sim.render.test_scene_graph import camera_of, stand, world_of
use_device(sys.argv[1])
panda._GPU_SHIFT *= float(sys.argv[3])
from er_gym.sim.render.scene_graph import scene_graph_of
found = {}
try:
    for scene, pose in (("FloorPlan1", (-0.5, 1.5, 150.0)), ("FloorPlan403", (-0.75, 1.75, 0.0))):
        world = world_of(scene)
        stand(world, *pose)
        for size in ((200, 150), (320, 240)):
            frames = scene_graph_of(scene).draw(world, camera_of(world, *size), depth=True)
            name = f"{scene}-{size[0]}"
            found["rgb-" + name], found["ids-" + name] = frames.rgb, frames.ids
            found["depth-" + name] = frames.depth
except RenderDeviceError as error:
    sys.exit(f"cannot: {error}")
np.savez(sys.argv[2], **found)
"""


def drawn_by(device: str, file: Path, shift: float = 1.0) -> dict[str, np.ndarray]:
    result = subprocess.run(
        [sys.executable, "-c", _DRAW, device, str(file), str(shift)],
        capture_output=True, text=True, timeout=120,
        env={"PYTHONPATH": ":".join(path for path in sys.path if path)},
    )  # fmt: skip
    if "cannot: " in result.stderr:
        pytest.skip(f"no EGL here: {result.stderr.strip().splitlines()[-1]}")
    assert result.returncode == 0, result.stderr
    return dict(np.load(file))


def test_both_devices_draw_the_same(tmp_path: Path) -> None:
    ours, theirs = (drawn_by(device, tmp_path / f"{device}.npz") for device in ("cpu", "gpu"))
    for name, one in ours.items():
        other = theirs[name]
        assert one.shape == other.shape
        if name.startswith("ids"):
            assert (one == other).mean() > 0.96, name  # the outlines' pixels differ
        elif name.startswith("depth"):
            assert (np.abs(one - other) < 0.02 + 0.02 * other).mean() > 0.95, name
        else:
            assert np.abs(one.astype(int) - other).mean() < 8, name


def test_the_shift_makes_more_pixels_agree(tmp_path: Path) -> None:
    ours = drawn_by("cpu", tmp_path / "cpu.npz")
    same = []
    for shift in (-1.0, 0.0, 1.0):
        theirs = drawn_by("gpu", tmp_path / f"{shift}.npz", shift)
        ids = [name for name in ours if name.startswith("ids")]
        same.append(np.mean([(ours[name] == theirs[name]).mean() for name in ids]))
    assert same == sorted(same)


def test_there_is_one_device_a_process() -> None:
    use_device("cpu")
    make_controller(headless=True, render_device="cpu").stop()
    with pytest.raises(RenderDeviceError, match="another process"):
        use_device("gpu")
    with pytest.raises(ValueError, match="choose one of: cpu, gpu"):
        use_device("tpu")
