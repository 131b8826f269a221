"""Measures many environments in one process, and in two, beside one environment.

    python -m benchmarks.perf.vectors [--envs 64] [--processes 2] [--obs-mode state] [--json FILE]

Random legal actions, tasks of all types in the training rooms. Each way has a process of its own,
since what a process knows of the rooms serves all its environments. The ways take turns, and are
measured by the processor's time. Several processes at the same time are measured by the clock,
beside one of them alone.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import click
import gymnasium
import numpy as np

import er_gym  # noqa: F401  (registers the environments)
from benchmarks.harness.measuring import Spent, in_turns, timed
from benchmarks.harness.output import json_option, print_table, write_figures
from er_gym.rollout.processes import CONTEXT, end_processes, start_process

ID = "ER-SingleSearch-v0"
SIZE = {"width": 300, "height": 300}
WAYS = ("sync", "vector_entry_point")


@dataclass(frozen=True)
class Rate:
    """Steps a second of one way: the median of the rounds, and the median of its ratios to the
    first way, round by round."""

    name: str
    rate: float
    ratio: float
    rounds: tuple[float, ...]


class Player:
    """Plays random legal actions; a vector environment, or a single one as a vector of one.

    Args:
        mode: of ``make_vec``; ``""`` for ``make``.
        n: the number of environments.
        arguments: of the environments.
    """

    def __init__(self, mode: str, n: int, arguments: dict[str, Any]) -> None:
        self._random, self._n, self._seed = np.random.default_rng(0), n, 0
        self._env: Any = (
            gymnasium.make_vec(ID, n, mode, **arguments)
            if mode
            else gymnasium.make(ID, **arguments)
        )
        self._single, self._over = not mode, False
        _, self._info = self._env.reset(seed=0)

    def play(self, steps: int) -> None:
        """At least so many steps of all environments together."""
        for _ in range(-(-steps // self._n)):
            mask = self._info["action_mask"]
            chosen = (self._random.random(mask.shape) * mask).argmax(axis=-1)
            if self._over:
                self._seed, self._over = self._seed + 1, False
                _, self._info = self._env.reset(seed=self._seed)
                continue
            _, _, terminated, truncated, self._info = self._env.step(
                int(chosen) if self._single else chosen
            )
            # As a vector environment does, a single one begins again with a turn of its own.
            self._over = self._single and (terminated or truncated)


class Players:
    """Processes that play, each in its way.

    Args:
        ways: the mode and the number of environments of each.
        arguments: of the environments.
        warm: steps that each plays first.
    """

    def __init__(
        self, ways: Sequence[tuple[str, int]], arguments: dict[str, Any], warm: int
    ) -> None:
        self._pipes: list[Connection] = []
        self._processes = []
        for way in ways:
            ours, theirs = CONTEXT.Pipe()
            self._processes.append(start_process(_serve, theirs, *way, arguments, warm))
            theirs.close()
            self._pipes.append(ours)
            ours.recv()

    def spent(self, places: Sequence[int], steps: int) -> list[Spent]:
        """What so many steps take, in some of them at the same time."""
        for place in places:
            self._pipes[place].send(steps)
        return [self._pipes[place].recv() for place in places]

    def close(self) -> None:
        """End the processes."""
        for pipe in self._pipes:
            pipe.close()
        end_processes(self._processes)


def _serve(pipe: Connection, mode: str, n: int, arguments: dict[str, Any], warm: int) -> None:
    player = Player(mode, n, arguments)
    player.play(warm)
    pipe.send(None)
    with suppress(EOFError):
        while True:
            pipe.send(timed(partial(player.play, pipe.recv())))


def measured(
    n: int, processes: int, arguments: dict[str, Any], steps: int, rounds: int
) -> list[Rate]:
    """One environment; n in one process in each way; and several processes of n."""
    ways = [("", 1), *((way, n) for way in WAYS), *[(WAYS[-1], n)] * (processes - 1)]
    players = Players(ways, arguments, 3 * steps)
    last = len(WAYS)  # the place of the first of the processes that play at the same time

    def alone(place: int) -> float:
        return steps / players.spent([place], steps)[0].processor

    def together(number: int) -> float:
        spent = players.spent(range(last, last + number), steps)
        return number * steps / max(each.clock for each in spent)

    names = ["one environment", *(f"{n} environments, {way}" for way in WAYS)]
    single = {name: partial(alone, place) for place, name in enumerate(names)}
    several = {
        f"{number} × {n} environments, by the clock": partial(together, number)
        for number in ([1, processes] if processes > 1 else [])
    }
    try:
        found = in_turns(single, rounds), in_turns(several, rounds)
    finally:
        players.close()
    return [
        _rate(name, rates, next(iter(way.values()))) for way in found for name, rates in way.items()
    ]


def _rate(name: str, rates: list[float], ones: list[float]) -> Rate:
    ratio = statistics.median(rate / one for rate, one in zip(rates, ones, strict=True))
    return Rate(name, statistics.median(rates), ratio, tuple(rates))


@click.command()
@click.option("--envs", default=64, show_default=True, type=click.IntRange(1, 4096))
@click.option("--processes", default=2, show_default=True, type=click.IntRange(1))
@click.option("--obs-mode", default="state", show_default=True, help="Pictures have 300×300.")
@click.option("--source", default="train", show_default=True, help="Of episodes.")
@click.option("--steps", default=1280, show_default=True, type=click.IntRange(1), help="A round.")
@click.option("--rounds", default=9, show_default=True, type=click.IntRange(1))
@json_option
def main(
    envs: int,
    processes: int,
    obs_mode: str,
    source: str,
    steps: int,
    rounds: int,
    file: Path | None,
) -> None:
    """Measure, and print one table."""
    arguments = {"obs_mode": obs_mode, "episode_source": source, "task_type": None, **SIZE}
    figures = measured(envs, processes, arguments, steps, rounds)
    rows = [
        (each.name, f"{each.rate:.0f}", f"{each.ratio:.2f}", f"{max(each.rounds):.0f}")
        for each in figures
    ]
    print_table(
        f"{obs_mode}: steps a second",
        ("what", "median", "times one", "best round"),
        rows,
        notes=["'times one': the median of the ratios in a round; of processes, times one process"],
    )
    write_figures(file, [asdict(each) for each in figures])


if __name__ == "__main__":
    main()
