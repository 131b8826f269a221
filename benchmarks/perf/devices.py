"""Compares the devices that draw, ``render_device="cpu"`` and ``"gpu"``, on this machine.

    python -m benchmarks.perf.devices [--device cpu --device gpu] [--seconds 2] [--json FILE]

Two tables, at sizes from 128×128 to 800×450: the pictures a second of the renderer alone and the
steps a second of environments with pictures that take turns in one process, and of several
processes of them; and how much the pictures of both devices have in common. Each device draws in
processes of its own. Of two pictures, most pixels that differ lie on outlines: the software
rasteriser rounds corners to whole pixels.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from benchmarks.checks.scene_jobs import choose_scenes
from benchmarks.harness.measuring import per_second
from benchmarks.harness.output import json_option, print_table, progress, write_figures
from benchmarks.perf.frames import Pictures, cameras, environment
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.sim.render.panda import DEVICES, RenderDeviceError, use_device
from er_gym.sim.render.scene_graph import scene_graph_of
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.world import World

SIZES = ((128, 128), (224, 224), (300, 300), (800, 450))
SCENES = 10
COMPARED = 6
"""Poses of each scene whose pictures are compared."""


@dataclass(frozen=True)
class Rate:
    """Pictures or steps a second.

    Attributes:
        device: that draws.
        processes, envs: how many processes, and environments in each; no environments: the
            renderer alone.
        width, height: of the pictures, pixels.
        value: in all processes together.
    """

    device: str
    processes: int
    envs: int
    width: int
    height: int
    value: float


@dataclass(frozen=True)
class Agreement:
    """What the pictures of two devices have in common, as shares of the pixels.

    Attributes:
        width, height: of the pictures, pixels.
        ids, worst: with the same instance, on average and in the worst picture.
        off_outline: of the pixels that are not beside an outline, those with the same instance.
        colour: the mean difference of a channel, of 255.
    """

    width: int
    height: int
    ids: float
    worst: float
    off_outline: float
    colour: float


# -- in a process that draws with one device -------------------------------------------------------


def renderer_rate(size: tuple[int, int], seconds: float) -> float:
    """Pictures a second of the renderer alone, at random poses."""
    pictures = Pictures(choose_scenes(str(SCENES)), size, depth=False)
    for _ in range(20 * SCENES):  # everything that is made only once
        pictures.draw()
    return per_second(pictures.draw, seconds)


def environment_rate(envs: int, size: tuple[int, int], seconds: float, device: str) -> float:
    """Steps a second of environments that each take a random legal step in turn, with resets."""
    random = np.random.default_rng(os.getpid())
    scenes = choose_scenes(str(SCENES))
    with ExitStack() as stack:
        playing: list[tuple[EmbodiedEnv, dict[str, Any]]] = []
        for number in range(envs):
            env = environment(scenes, size, device)
            stack.callback(env.close)
            playing.append((env, env.reset(seed=number)[1]))
        turns = cycle(range(envs))

        def step() -> None:
            turn = next(turns)
            env, info = playing[turn]
            action = int(random.choice(np.flatnonzero(info["action_mask"])))
            *_, terminated, truncated, info = env.step(action)
            playing[turn] = (env, env.reset()[1] if terminated or truncated else info)

        until = time.perf_counter() + min(1.0, seconds)
        while time.perf_counter() < until:
            step()
        return per_second(step, seconds)


def pictures(size: tuple[int, int]) -> list[tuple[NDArray[np.uint8], NDArray[np.uint8]]]:
    """The instances and colours at the same random poses, whatever draws them."""
    random, found = np.random.default_rng(0), []
    for name in choose_scenes(str(SCENES)):
        world = World.load(load_scene(name), Settings())
        for camera in cameras(world, size, random)[:COMPARED]:
            frames = scene_graph_of(name).draw(world, camera)
            found.append((frames.ids, frames.rgb))
    return found


# -- in the process that compares ------------------------------------------------------------------


def workers(device: str, number: int) -> ProcessPoolExecutor:
    """Processes that draw with a device."""
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(number, spawn, initializer=use_device, initargs=(device,))


def rates(
    device: str, envs: tuple[int, ...], processes: int, seconds: float
) -> Iterator[tuple[str, Rate]]:
    """Everything that is measured of one device, one after the other."""
    with workers(device, 1) as one:
        for width, height in SIZES:
            value = one.submit(renderer_rate, (width, height), seconds).result()
            yield f"{device}, {width}×{height}", Rate(device, 1, 0, width, height, value)
        for number in envs:
            for width, height in SIZES:
                job = one.submit(environment_rate, number, (width, height), seconds, device)
                yield (
                    f"{device}, {number} environments, {width}×{height}",
                    Rate(device, 1, number, width, height, job.result()),
                )
    if processes > 1:
        each = max(1, max(envs) // processes)
        with workers(device, processes) as many:
            for width, height in SIZES:
                jobs = [
                    many.submit(environment_rate, each, (width, height), seconds, device)
                    for _ in range(processes)
                ]
                value = sum(job.result() for job in jobs)
                yield (
                    f"{device}, {processes} processes, {width}×{height}",
                    Rate(device, processes, each, width, height, value),
                )


def beside_outlines(ids: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """The pixels whose neighbours above, below, left or right show another instance."""
    found = np.zeros(ids.shape, dtype=bool)
    for axis in (0, 1):
        changes = np.diff(ids.astype(np.int16), axis=axis) != 0
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        found[tuple(before)] |= changes
        found[tuple(after)] |= changes
    return found


def agreement(size: tuple[int, int], one: str, other: str) -> Agreement:
    """Compare the pictures of two devices."""
    drawn = []
    for device in (one, other):
        with workers(device, 1) as worker:
            drawn.append(worker.submit(pictures, size).result())
    same, inside, colour = [], [], []
    for (ids, rgb), (their_ids, their_rgb) in zip(*drawn, strict=True):
        equal, outline = ids == their_ids, beside_outlines(ids) | beside_outlines(their_ids)
        same.append(float(equal.mean()))
        inside.append(float(equal[~outline].mean()))
        colour.append(float(np.abs(rgb.astype(int) - their_rgb).mean()))
    means = (float(np.mean(values)) for values in (inside, colour))
    return Agreement(*size, float(np.mean(same)), min(same), *means)


def show(found: list[Rate], compared: list[Agreement]) -> None:
    """Print the tables."""
    sizes = [f"{width}×{height}" for width, height in SIZES]
    rows: dict[tuple[str, int, int], list[str]] = {}
    for rate in found:
        key = (rate.device, rate.processes, rate.envs)
        rows.setdefault(key, []).append(f"{rate.value:.0f}")
    print_table(
        f"pictures or steps a second ({os.cpu_count()} cores)",
        ("device", "processes", "environments in each", *sizes),
        [(device, n, envs or "renderer alone", *row) for (device, n, envs), row in rows.items()],
        words=3,
    )
    if compared:
        print_table(
            "pixels that both devices draw alike, %",
            ("size", "instances", "worst picture", "off outlines", "colour differs by, of 255"),
            [
                (f"{each.width}×{each.height}", *(f"{100 * share:.2f}" for share in
                 (each.ids, each.worst, each.off_outline)), f"{each.colour:.1f}")
                for each in compared
            ],
        )  # fmt: skip


@click.command()
@click.option(
    "--device", "devices", multiple=True, type=click.Choice(list(DEVICES)), default=list(DEVICES),
    show_default=True, help="A device to measure; may be repeated.",
)  # fmt: skip
@click.option(
    "--envs", multiple=True, type=click.IntRange(1), default=(1, 16, 64, 256), show_default=True,
    help="The number of environments in one process; may be repeated.",
)  # fmt: skip
@click.option(
    "--processes", type=click.IntRange(1), default=os.cpu_count() or 1, show_default=True,
    help="Also share the largest number of environments among so many processes.",
)  # fmt: skip
@click.option("--seconds", default=2.0, show_default=True, type=click.FloatRange(0.01))
@json_option
def main(
    devices: tuple[str, ...],
    envs: tuple[int, ...],
    processes: int,
    seconds: float,
    file: Path | None,
) -> None:
    """Measure, and print the tables."""
    found: list[Rate] = []
    try:
        for device in devices:
            for what, rate in rates(device, envs, processes, seconds):
                click.echo(f"{what}: {rate.value:.0f}", err=True)
                found.append(rate)
        pair = devices if len(devices) > 1 else ()
        compared = [agreement(size, *pair) for size in progress(SIZES, "agreement")] if pair else []
    except RenderDeviceError as error:
        raise click.ClickException(str(error)) from error
    show(found, compared)
    write_figures(
        file, {"rates": list(map(asdict, found)), "agreement": list(map(asdict, compared))}
    )


if __name__ == "__main__":
    main()
