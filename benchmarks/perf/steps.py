"""Measures how fast the environment steps, resets and starts, and MiniGrid in the same run.

    python -m benchmarks.perf.steps [--seconds 4] [--rounds 3] [--json FILE]
    python -m benchmarks.perf.steps --against COMMIT [--seconds 4] [--rounds 5]

Random legal actions, over all registered environments. The candidates take turns, round after
round, and the median of the rounds is printed, so a busy machine slows all alike.

``--against`` compares this checkout, with what is not committed, with another commit: each runs its
own script in turn, the table has the ratio of each row, and exit code 1 says that one is worse.
"""

from __future__ import annotations

import importlib.util
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click
import gymnasium
import numpy as np

import er_gym  # noqa: F401  (registers the environments)
from benchmarks.harness.measuring import in_turns
from benchmarks.harness.output import json_option, print_table, write_figures
from benchmarks.harness.worktree import Commit
from benchmarks.perf import against
from er_gym.tasks.types import TASK_TYPES
from er_gym.thor import make_controller

MINIGRID = "MiniGrid-DoorKey-8x8-v0"
KITCHEN = "FloorPlan1"
VARIANTS: dict[str, dict[str, Any]] = {
    "no images (state)": {"obs_mode": "state"},
    "rgb 300×300": {"obs_mode": "rgb", "width": 300, "height": 300},
    "rgb 800×450": {"obs_mode": "rgb", "width": 800, "height": 450},
}
_FRESH = """
import time
start = time.perf_counter()
import gymnasium, er_gym
imported = time.perf_counter()
env = gymnasium.make("ER-SingleSearch-v0", obs_mode={obs_mode!r})
env.reset(seed=0)
print(imported - start, time.perf_counter() - start)
"""
_RESIDENT = """
import gymnasium, numpy, er_gym
env = gymnasium.make("ER-PickupAndPut-v0", obs_mode={obs_mode!r})
_, info = env.reset(seed=0)
random = numpy.random.default_rng(0)
for _ in range(50):
    _, _, ended, cut, info = env.step(int(random.choice(numpy.flatnonzero(info["action_mask"]))))
    if ended or cut:
        _, info = env.reset()
print(open("/proc/self/statm").read().split()[1])
"""


@dataclass(frozen=True)
class Measurement:
    """One row of the table.

    Attributes:
        name: what was measured.
        value: the median of ``rounds``, or the one value.
        unit: of the values.
        rounds: what each round gave.
    """

    name: str
    value: float
    unit: str
    rounds: tuple[float, ...] = ()

    @staticmethod
    def of(name: str, rounds: list[float], unit: str) -> Measurement:
        return Measurement(name, statistics.median(rounds), unit, tuple(rounds))


class RandomPlayer:
    """Random legal actions in some environments, an episode of each in turn."""

    def __init__(self, envs: list[gymnasium.Env[Any, Any]], seed: int) -> None:
        self._envs = envs
        self._random = np.random.default_rng(seed)
        self._turn = 0
        self._legal: np.ndarray | None = None
        self.resets: list[float] = []
        self._over = True

    @property
    def _env(self) -> gymnasium.Env[Any, Any]:
        return self._envs[self._turn % len(self._envs)]

    def steps_per_second(self, seconds: float) -> float:
        """Play for a time; time spent in ``reset`` is counted separately."""
        steps, stepping = 0, 0.0
        while stepping < seconds:
            if self._over:
                self._begin()
            action = int(self._random.choice(self._actions()))
            start = time.perf_counter()
            _, _, terminated, truncated, info = self._env.step(action)
            stepping += time.perf_counter() - start
            steps += 1
            self._legal = info.get("action_mask")
            self._over = terminated or truncated
        return steps / stepping

    def _begin(self) -> None:
        self._turn += 1
        start = time.perf_counter()
        _, info = self._env.reset(seed=int(self._random.integers(2**31)))
        self.resets.append(time.perf_counter() - start)
        self._legal = info.get("action_mask")

    def _actions(self) -> np.ndarray:
        """The legal actions; all actions if the environment has no mask."""
        if self._legal is None:
            return np.arange(self._env.action_space.n)  # type: ignore[attr-defined]
        return np.flatnonzero(self._legal)


@contextmanager
def environments(**arguments: Any) -> Iterator[list[gymnasium.Env[Any, Any]]]:
    """One environment for each registered id."""
    with ExitStack() as stack:
        envs = []
        for kind in TASK_TYPES:
            env = gymnasium.make(kind.env_id, **arguments)
            stack.callback(env.close)
            envs.append(env)
        yield envs


def step_rates(rounds: int, seconds: float) -> list[Measurement]:
    """Steps per second of each variant and of MiniGrid, and reset times, timed in turns."""
    with ExitStack() as stack:
        # Each plays other episodes: the engine remembers what it has seen, for all in the process.
        players = {
            name: RandomPlayer(stack.enter_context(environments(**arguments)), seed)
            for seed, (name, arguments) in enumerate(VARIANTS.items())
        }
        if importlib.util.find_spec("minigrid") is not None:
            import minigrid  # noqa: F401  (registers its environments)

            env = gymnasium.make(MINIGRID)
            stack.callback(env.close)
            players[MINIGRID] = RandomPlayer([env], seed=0)
        for player in players.values():
            player.steps_per_second(min(0.3, seconds))  # load everything that is loaded only once
            player.resets.clear()
        ways = {name: partial(each.steps_per_second, seconds) for name, each in players.items()}
        rates = in_turns(ways, rounds, "steps")
    figures = [Measurement.of(f"steps, {name}", found, "steps/s") for name, found in rates.items()]
    for name in VARIANTS:
        times = 1000 * np.array(players[name].resets)
        figures += [
            Measurement(f"reset p{part}, {name}", float(np.percentile(times, part)), "ms")
            for part in (50, 95)
            if len(times)
        ]
    return figures


def interactable_poses(rounds: int) -> Measurement:
    """Mean time of GetInteractablePoses over every object of a kitchen but the first asked for."""
    found = []
    for _ in range(rounds):
        controller = make_controller(scene=KITCHEN, headless=True, gridSize=0.25)
        times = []
        for entry in controller.last_event.metadata["objects"]:
            start = time.perf_counter()
            controller.step(action="GetInteractablePoses", objectId=entry["objectId"])
            times.append(1000 * (time.perf_counter() - start))
        controller.stop()
        found.append(float(np.mean(times[1:])))
    return Measurement.of(f"GetInteractablePoses at 0.25 m, {KITCHEN}'s objects, mean", found, "ms")


def _fresh(program: str, obs_mode: str) -> list[float]:
    """The numbers that a program prints in a new process."""
    command = [sys.executable, "-c", program.format(obs_mode=obs_mode)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return [float(word) for word in told.split()]


def fresh_start(rounds: int) -> list[Measurement]:
    """Seconds to the first observation in a new process, import included."""
    figures = []
    for obs_mode in ("state", "rgb"):
        imported, ready = zip(*(_fresh(_FRESH, obs_mode) for _ in range(rounds)), strict=True)
        if obs_mode == "state":
            figures.append(Measurement.of("fresh process: import", list(imported), "s"))
        name = f"fresh process: import, make, reset, first observation ({obs_mode})"
        figures.append(Measurement.of(name, list(ready), "s"))
    return figures


def environment_memory() -> list[Measurement]:
    """The memory of a new process with one environment after 50 steps."""
    figures = []
    for obs_mode in ("state", "rgb"):
        (pages,) = _fresh(_RESIDENT, obs_mode)
        name = f"resident memory, one environment ({obs_mode})"
        figures.append(Measurement(name, pages * os.sysconf("SC_PAGE_SIZE") / 2**20, "MiB"))
    return figures


def show(figures: list[Measurement]) -> None:
    """Print the one table."""
    rows = []
    for figure in figures:
        digits = 0 if figure.value >= 100 else 2
        rounds = "  ".join(f"{value:.{digits}f}" for value in figure.rounds)
        rows.append((figure.name, f"{figure.value:.{digits}f}", figure.unit, rounds))
    title = f"er-gym, {os.cpu_count()} cores, Python {sys.version.split()[0]}"
    there = any(MINIGRID in figure.name for figure in figures)
    missing = (
        "MiniGrid is not installed, so there is nothing to compare with: pip install -e '.[dev]'"
    )
    notes = [] if there else [missing]
    print_table(title, ("what", "median", "unit", "rounds"), rows, notes=notes)


@click.command()
@click.option("--seconds", default=4.0, show_default=True, type=click.FloatRange(0.01))
@click.option("--rounds", default=3, show_default=True, type=click.IntRange(1))
@json_option
@click.option("--against", "commit", type=Commit(), help="Compare with this commit.")
def main(seconds: float, rounds: int, file: Path | None, commit: str | None) -> None:
    """Measure, and print one table."""
    if commit is not None:
        if rounds < against.LEAST_ROUNDS:
            raise click.UsageError(f"--against takes at least --rounds {against.LEAST_ROUNDS}")
        once = ["--rounds", "1", "--seconds", str(seconds)]
        compared = against.compare("benchmarks.perf.steps", once, commit, rounds)
        write_figures(file, [asdict(row) for row in compared])
        raise SystemExit(against.show(compared, commit))
    figures = step_rates(rounds, seconds)
    figures.append(interactable_poses(rounds))
    figures += fresh_start(rounds) + environment_memory()
    show(figures)
    write_figures(file, [asdict(figure) for figure in figures])


if __name__ == "__main__":
    main()
