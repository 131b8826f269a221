"""Measures the pictures per second of one process, and of MuJoCo's renderers in the same run.

    python -m benchmarks.perf.frames [--seconds 3] [--rounds 3] [--soak] [--json FILE]

Random poses in ten scenes of all kinds of room: the renderer alone, and whole steps of the
environment with random legal actions. MuJoCo draws, at poses of the same kind in the same rooms, a
box for each object that our renderer draws and a textured plane for the floor: colours alone,
without the instances that ours come with, and Mesa may use all cores, where ours uses one.

MuJoCo is only for the comparison: pip install mujoco. If one of its renderers does not run, the
output says what it needs. The candidates take turns, round after round, and the median of the
rounds is printed. ``--soak`` plays 10,000 steps and changes the scene 200 times, and prints how
memory grows.
"""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import statistics
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import partial
from itertools import cycle, product
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.checks.scene_jobs import choose_scenes
from benchmarks.checks.soak import free_play
from benchmarks.harness.measuring import in_turns, per_second
from benchmarks.harness.output import json_option, print_table, progress, write_figures
from benchmarks.perf.steps import RandomPlayer
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.cluster.actors import resident_memory
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.scene_graph import scene_graph_of
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import LIGHTS, SOFT, Settings
from er_gym.sim.world import World

SIZES = ((128, 128), (224, 224), (300, 300), (800, 450))
SCENES = 10
FIELD_OF_VIEW = 90.0
HORIZONS = (-30.0, 0.0, 30.0)
POSES = 20
"""Pictures in a row of one scene."""
STEPS_WANTED = (1200, 700, 500, 160)
MEMORY_WANTED = 300
"""Environment steps per second at each size, and megabytes that a process may take up."""
SOAK_STEPS, SOAK_SCENES = 10_000, 200
STEP = "environment: a step, rgb"
_MUJOCO_TIMEOUT = 300.0
_MUJOCO_GL = {"egl": "libegl1 libgl1-mesa-dri", "osmesa": "libosmesa6"}
"""MuJoCo's renderers that need no window, and the Debian packages that each needs."""
_MUJOCO = """
import json, os, sys, time
import mujoco
told = json.load(sys.stdin)
drawn = []
for xml in told["scenes"]:
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, told["height"], told["width"])
    for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
        renderer.scene.flags[flag] = told["shadows"]
    drawn.append((renderer, data, range(model.ncam)))
def play(seconds):
    frames, start = 0, time.perf_counter()
    while True:
        for renderer, data, cameras in drawn:
            for camera in cameras:
                renderer.update_scene(data, camera)
                renderer.render()
                frames += 1
                if time.perf_counter() - start > seconds:
                    return frames / (time.perf_counter() - start)
play(told["seconds"] / 4)
print(play(told["seconds"]), flush=True)
os._exit(0)  # OSMesa's renderer cannot be taken down
"""


@dataclass(frozen=True)
class FrameRate:
    """One figure: the median of what each round gave.

    Attributes:
        name: what was measured.
        size: of the pictures, pixels.
        value, rounds: pictures or steps per second.
    """

    name: str
    size: tuple[int, int]
    value: float
    rounds: tuple[float, ...]


@dataclass(frozen=True)
class Memory:
    """The memory of the process at some point, megabytes (RSS)."""

    name: str
    megabytes: float


def cameras(world: World, size: tuple[int, int], random: np.random.Generator) -> list[Camera]:
    """Random poses where the agent can stand."""
    found, height = [], float(world.agent.camera[1])
    for x, z in random.choice(world.scene.reachable, POSES):
        yaw, horizon = float(random.uniform(0, 360)), float(random.choice(HORIZONS))
        found.append(Camera((float(x), height, float(z)), yaw, horizon, FIELD_OF_VIEW, *size))
    return found


class Pictures:
    """Draws one pose after the other in one scene after the other."""

    def __init__(
        self, scenes: list[str], size: tuple[int, int], depth: bool, light: str = SOFT
    ) -> None:
        random = np.random.default_rng(0)
        worlds = [World.load(load_scene(name), Settings()) for name in scenes]
        self._poses = cycle(
            [(world, camera) for world in worlds for camera in cameras(world, size, random)]
        )
        self._depth, self._light = depth, light

    def draw(self) -> None:
        """The next one."""
        world, camera = next(self._poses)
        scene_graph_of(world.scene.name, self._light).draw(world, camera, self._depth)


def environment(scenes: list[str], size: tuple[int, int], device: str = "cpu") -> EmbodiedEnv:
    """An environment whose every episode is in one of the scenes, at random."""
    tasks = [free_play(name) for name in scenes]
    width, height = size
    return EmbodiedEnv(
        tasks, obs_mode="rgb", width=width, height=height, instances="explore", render_device=device
    )


# -- MuJoCo ----------------------------------------------------------------------------------------


def mujoco_scene(name: str, size: tuple[int, int]) -> str:
    """A room as MuJoCo's XML: a box for each object drawn, a textured floor, and cameras.

    MuJoCo's x, y and z are AI2-THOR's x, z and y.
    """
    world, random = World.load(load_scene(name), Settings()), np.random.default_rng(0)
    width, height = size
    floor = next(world.of_type("Floor"))
    shown = [i for i in np.flatnonzero(~world.hidden).tolist() if i != floor]

    def words(values: Any) -> str:
        x, y, z = np.asarray(values).tolist()
        return f"{x:.4f} {z:.4f} {y:.4f}"

    lines = [
        f'<geom type="plane" size="20 20 1" material="tiles" pos="0 0 {world.high[floor, 1]}"/>'
    ]
    for i in shown:
        middle, half = (world.low[i] + world.high[i]) / 2, (world.high[i] - world.low[i]) / 2
        half, colour = np.maximum(half, 0.002), random.uniform(0.2, 1, 3)
        rgba = " ".join(f"{value:.2f}" for value in (*colour, 1))
        lines.append(f'<geom type="box" pos="{words(middle)}" size="{words(half)}" rgba="{rgba}"/>')
    for camera in cameras(world, size, random):
        right, up, _ = camera.axes
        lines.append(
            f'<camera pos="{words(camera.position)}" fovy="{camera.fov}" '
            f'xyaxes="{words(right)} {words(up)}"/>'
        )
    return f"""<mujoco>
  <visual><global offwidth="{width}" offheight="{height}"/></visual>
  <asset>
    <texture name="tiles" type="2d" builtin="checker" width="256" height="256"
      rgb1=".6 .5 .4" rgb2=".5 .4 .3"/>
    <material name="tiles" texture="tiles" texrepeat="40 40"/>
  </asset>
  <worldbody><light pos="0 0 4"/>{"".join(lines)}</worldbody>
</mujoco>"""


@dataclass(frozen=True)
class MuJoCo:
    """One of MuJoCo's renderers, in a process of its own.

    Attributes:
        gl: what ``MUJOCO_GL`` calls it.
        shadows: as it comes; or without shadows, reflections and smoothed edges, as ours are.
    """

    gl: str
    shadows: bool

    @property
    def name(self) -> str:
        return f"MuJoCo, {self.gl}, {'as it comes' if self.shadows else 'no shadows or smoothing'}"

    def per_second(self, scenes: list[str], size: tuple[int, int], seconds: float) -> float:
        """Pictures a second.

        Raises:
            RuntimeError: it does not run here; the message is the first error that it met.
        """
        rooms = [mujoco_scene(name, size) for name in scenes]
        if not self.shadows:
            plain = '<visual><quality offsamples="0"/>'
            rooms = [room.replace("<visual>", plain) for room in rooms]
        told = {"scenes": rooms, "width": size[0], "height": size[1],
                "shadows": self.shadows, "seconds": seconds}  # fmt: skip
        try:
            result = subprocess.run(
                [sys.executable, "-c", _MUJOCO], input=json.dumps(told), text=True, check=True,
                capture_output=True, env={**os.environ, "MUJOCO_GL": self.gl},
                timeout=_MUJOCO_TIMEOUT,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise RuntimeError(f"it was not done after {_MUJOCO_TIMEOUT:.0f} s") from None
        except subprocess.CalledProcessError as error:
            raise RuntimeError(_first_error(error.stderr)) from None
        return float(result.stdout.split()[-1])


def _first_error(said: str) -> str:
    """The exception that came first, out of what Python printed."""
    lines = [line for line in said.splitlines() if line and not line.startswith(" ")]
    errors = [line for line in lines if "Error" in line.split(":")[0]]
    return (errors or lines or ["it said nothing"])[0]


def available_renderers(scenes: list[str]) -> list[MuJoCo]:
    """MuJoCo's renderers that run here; says why the others do not."""
    if importlib.util.find_spec("mujoco") is None:
        click.echo("nothing to compare with: pip install mujoco", err=True)
        return []
    found = []
    for gl, packages in _MUJOCO_GL.items():
        try:
            MuJoCo(gl, False).per_second(scenes[:1], (64, 64), 0.1)
        except RuntimeError as error:
            why = f"MuJoCo's {gl} renderer does not run here ({error}): apt install {packages}"
            click.echo(why, err=True)
        else:
            found += [MuJoCo(gl, True), MuJoCo(gl, False)]
    return found


# -- what is measured ------------------------------------------------------------------------------


def rates(scenes: list[str], rounds: int, seconds: float) -> list[FrameRate]:
    """Pictures and steps per second at each size, timed in turns."""
    ways: dict[tuple[str, tuple[int, int]], Callable[[], float]] = {}
    with ExitStack() as stack:
        mujoco_renderers = available_renderers(scenes)
        for size in SIZES:
            env = environment(scenes, size)
            stack.callback(env.close)
            for light, depth in product(LIGHTS, (False, True)):
                name = f"renderer, {light} light: rgb, instances{', depth' if depth else ''}"
                pictures = Pictures(scenes, size, depth, light)
                ways[name, size] = partial(per_second, pictures.draw, seconds)
            ways[STEP, size] = partial(RandomPlayer([env], seed=0).steps_per_second, seconds)
            for renderer in mujoco_renderers:
                ways[renderer.name, size] = partial(renderer.per_second, scenes, size, seconds)
        for (name, _), measure in ways.items():
            if "MuJoCo" not in name:  # load everything that is loaded only once
                measure()
        found = in_turns(ways, rounds, "rates")
    return [
        FrameRate(name, size, statistics.median(values), tuple(values))
        for (name, size), values in found.items()
    ]


def soak() -> list[Memory]:
    """How memory grows over many steps in a few scenes, and over changes between all scenes."""
    random = np.random.default_rng(0)
    few = choose_scenes(str(SCENES))
    env = environment(list(SCENE_NAMES), SIZES[2])

    def play(scenes: list[str], steps: int) -> float:
        for name in progress(scenes, "soak"):
            _, info = env.reset(seed=0, options={"task": free_play(name)})
            for _ in range(steps):
                _, _, ended, cut, info = env.step(
                    int(random.choice(np.flatnonzero(info["action_mask"])))
                )
                if ended or cut:
                    _, info = env.reset(options={"task": free_play(name)})
        return resident_memory() / 1e6

    found = [Memory(f"soak: {SCENES} scenes seen", play(few, 20))]
    for part in (1, 2):
        steps = SOAK_STEPS // 2
        name = f"soak: {part * steps} steps in them"
        found.append(Memory(name, play(few, steps // SCENES)))
    for part in (1, 2):
        megabytes = play(random.permutation(np.resize(SCENE_NAMES, SOAK_SCENES)).tolist(), 1)
        found.append(Memory(f"soak: {part * SOAK_SCENES} changes among all scenes", megabytes))
    env.close()
    return found


# -- what is printed -------------------------------------------------------------------------------


def show(figures: list[FrameRate], memory: list[Memory]) -> None:
    """Print the rates and the memory."""
    found: dict[str, list[str]] = {}
    for figure in figures:
        found.setdefault(figure.name, []).append(f"{figure.value:.0f}")
    rows = [(name, *values) for name, values in found.items()]
    rows.append((f"wanted of {STEP}", *(f">= {wanted}" for wanted in STEPS_WANTED)))
    cores = f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}"
    sizes = ("{}×{}".format(*size) for size in SIZES)
    print_table(f"pictures a second in one process ({cores})", ("what", *sizes), rows)
    taken = [(entry.name, f"{entry.megabytes:.0f}") for entry in memory]
    taken.append(("wanted", f"<= {MEMORY_WANTED}"))
    print_table("memory of the process (RSS)", ("when", "MB"), taken)


@click.command()
@click.option("--seconds", default=3.0, show_default=True, type=click.FloatRange(0.1))
@click.option("--rounds", default=3, show_default=True, type=click.IntRange(1))
@click.option("--soak", "soaked", is_flag=True, help="Also check whether memory grows.")
@json_option
def main(seconds: float, rounds: int, soaked: bool, file: Path | None) -> None:
    """Measure, and print two tables."""
    figures = rates(choose_scenes(str(SCENES)), rounds, seconds)
    name = f"{SCENES} scenes drawn and played at {len(SIZES)} sizes"
    memory = [Memory(name, resident_memory() / 1e6)]
    if soaked:
        memory += soak()
    show(figures, memory)
    write_figures(file, {"rates": list(map(asdict, figures)), "memory": list(map(asdict, memory))})


if __name__ == "__main__":
    main()
