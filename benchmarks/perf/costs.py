"""Measures what a step costs: by the objects of the room, and in the processor's instructions.

    python -m benchmarks.perf.costs [--rooms 12] [--steps 600] [--json FILE]
    python -m benchmarks.perf.costs --instructions [--json FILE]

Random legal actions in single environments with the observation ``state``. The first call plays
rooms with few and with many objects, and measures the processor's time. The second counts
instructions with valgrind, of er-gym and of MiniGrid: that takes minutes, but the noise of the
machine does not change it. It counts a short run and one three times as long: the difference is the
steps', and their resets'.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import gymnasium
import numpy as np

import er_gym  # noqa: F401  (registers the environments)
from benchmarks.harness.output import ROOT, json_option, print_table, progress, write_figures
from benchmarks.perf.steps import MINIGRID
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.suites import load_suite

_OURS = "ER-PickupAndPut-v0"
_COUNTED = 500
"""The steps of the shorter of two runs whose instructions are counted."""


def rooms(number: int) -> Iterator[tuple[str, int]]:
    """Training rooms from those with the fewest objects to those with the most, and how many."""
    env = EmbodiedEnv("train", obs_mode="state")
    counts = {}
    for scene in sorted({task.scene for task in load_suite("train").tasks}):
        env.reset(seed=0, options={"scene": scene})
        counts[scene] = len(env.objects)
    env.close()
    ordered = sorted(counts.items(), key=lambda item: item[1])
    for k in np.linspace(0, len(ordered) - 1, number).round().astype(int).tolist():
        yield ordered[k]


def step_seconds(scene: str, steps: int) -> float:
    """Seconds of processor time that a step takes in a room; resets are not counted."""
    env = EmbodiedEnv("train", obs_mode="state")
    random, spent = np.random.default_rng(0), 0.0
    info: dict[str, Any] | None = None
    for number in range(steps):
        if info is None:
            _, info = env.reset(seed=number, options={"scene": scene})
        action = int(random.choice(np.flatnonzero(info["action_mask"])))
        began = time.process_time()
        _, _, ended, cut, info = env.step(action)
        spent += time.process_time() - began
        info = None if ended or cut else info
    env.close()
    return spent / steps


def by_objects(number: int, steps: int) -> list[dict[str, Any]]:
    """A row for each room."""
    found = []
    for scene, objects in progress([*rooms(number)], "rooms"):
        found.append({"room": scene, "objects": objects, "seconds": step_seconds(scene, steps)})
    return found


def play(name: str, steps: int) -> None:
    """Play some steps of an environment: what valgrind counts."""
    if name == MINIGRID:
        import minigrid  # noqa: F401  (registers its environments)

    arguments: dict[str, Any] = {} if name == MINIGRID else {"obs_mode": "state"}
    env, random = gymnasium.make(name, **arguments), np.random.default_rng(0)
    over, info = True, dict[str, Any]()
    for number in range(steps):
        if over:
            _, info = env.reset(seed=number)
        mask = info.get("action_mask")
        count = env.action_space.n  # type: ignore[attr-defined]
        legal = np.arange(count) if mask is None else np.flatnonzero(mask)
        _, _, ended, cut, info = env.step(int(random.choice(legal)))
        over = ended or cut


def instructions(name: str, steps: int) -> int:
    """The instructions of a process that plays some steps."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        raise click.ClickException("valgrind is not installed: apt-get install valgrind")
    command = [
        *(valgrind, "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"),
        *(sys.executable, "-m", "benchmarks.perf.costs", "--play", name, "--steps", str(steps)),
    ]
    # Else sets come in another order each time.
    fixed = {**os.environ, "PYTHONHASHSEED": "0", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, cwd=ROOT, env=fixed, capture_output=True, text=True)
    told = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
    if done.returncode or told is None:
        raise click.ClickException(f"valgrind failed: {done.stderr.strip()[-500:]}")
    return int(told[1].replace(",", ""))


@click.command()
@click.option("--rooms", "number", default=12, show_default=True, type=click.IntRange(2))
@click.option("--steps", default=600, show_default=True, type=click.IntRange(1))
@click.option("--instructions", "counts", is_flag=True, help="Count instructions with valgrind.")
@click.option("--play", "name", hidden=True)
@json_option
def main(number: int, steps: int, counts: bool, name: str | None, file: Path | None) -> None:
    """Measure, and print."""
    if name is not None:
        play(name, steps)
    elif counts:
        found = {}
        for each in (_OURS, MINIGRID):
            less, more = (instructions(each, factor * _COUNTED) for factor in (1, 3))
            found[each] = (more - less) / (2 * _COUNTED)
        rows = [(each, f"{value:,.0f}") for each, value in found.items()]
        print_table("instructions, resets included", ("environment", "a step"), rows)
        write_figures(file, found)
    else:
        told = by_objects(number, steps)
        objects, spent = (np.array([row[key] for row in told]) for key in ("objects", "seconds"))
        slope, rest = np.polyfit(objects, 1e6 * spent, 1)
        print_table(
            "processor time of a step, by room",
            ("room", "objects", "µs"),
            [(row["room"], row["objects"], f"{1e6 * row['seconds']:.0f}") for row in told],
            notes=[f"about {rest:.0f} µs and {slope:.1f} µs for each object"],
        )
        write_figures(file, told)


if __name__ == "__main__":
    main()
