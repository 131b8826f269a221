"""Measures many environments in one process, and in two, beside one environment.

    python -m benchmarks.perf.vectors [--envs 64] [--processes 2] [--obs-mode state] [--json FILE]

Random legal actions, tasks of all types in the training rooms, by the processor's time: a busy
machine makes all rates smaller, and hardly changes their ratios. The ways take turns. Processes
are measured by the clock, at the same time, beside one of them alone.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import click
import gymnasium
import numpy as np

import er_gym  # noqa: F401  (registers the environments)
from benchmarks.harness.measuring import in_turns, timed
from benchmarks.harness.output import json_option, print_table, write_figures
from er_gym.rollout.processes import CONTEXT, end_processes, start_process

ID = "ER-SingleSearch-v0"
SIZE = {"width": 300, "height": 300}
WAYS = ("sync", "vector_entry_point")


@dataclass(frozen=True)
class Rate:
    """Steps a second of one way: the median of the rounds, and the median of its ratio to one
    environment's in the same round."""

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
                self._seed += 1
                _, self._info = self._env.reset(seed=self._seed)
                continue
            _, _, terminated, truncated, self._info = self._env.step(
                int(chosen) if self._single else chosen
            )
            # As a vector environment does, a single one begins again with a turn of its own.
            self._over = self._single and (terminated or truncated)

    def rate(self, steps: int) -> float:
        """Steps in a second of the processor."""
        return steps / timed(partial(self.play, steps)).processor


def in_one_process(n: int, arguments: dict[str, Any], steps: int, rounds: int) -> list[Rate]:
    """One environment, and n in each way."""
    players = {"one environment": Player("", 1, arguments)}
    players |= {f"{n} environments, {way}": Player(way, n, arguments) for way in WAYS}
    for player in players.values():
        player.play(3 * steps)
    found = in_turns(
        {name: partial(player.rate, steps) for name, player in players.items()}, rounds
    )
    ones = found["one environment"]
    return [_rate(name, rates, ones) for name, rates in found.items()]


def _rate(name: str, rates: list[float], ones: list[float]) -> Rate:
    ratio = statistics.median(rate / one for rate, one in zip(rates, ones, strict=True))
    return Rate(name, statistics.median(rates), ratio, tuple(rates))


def in_processes(
    number: int, n: int, arguments: dict[str, Any], steps: int, rounds: int
) -> list[Rate]:
    """Some processes of n environments each, at the same time, beside one of them alone."""
    pipes, processes = [], []
    try:
        for _ in range(number):
            ours, theirs = CONTEXT.Pipe()
            processes.append(start_process(_serve, theirs, n, arguments, 3 * steps))
            theirs.close()
            pipes.append(ours)
        for pipe in pipes:
            pipe.recv()

        def together(some: int) -> float:
            began = time.perf_counter()
            for pipe in pipes[:some]:
                pipe.send(steps)
            for pipe in pipes[:some]:
                pipe.recv()
            return some * steps / (time.perf_counter() - began)

        ways: dict[int, Callable[[], float]] = {
            some: partial(together, some) for some in (1, number)
        }
        found = in_turns(ways, rounds)
    finally:
        for pipe in pipes:
            pipe.close()
        end_processes(processes)
    return [_rate(f"{some} × {n} environments, clock", found[some], found[1]) for some in found]


def _serve(pipe: Connection, n: int, arguments: dict[str, Any], warm: int) -> None:
    player = Player(WAYS[-1], n, arguments)
    player.play(warm)
    pipe.send(None)
    try:
        while True:
            player.play(pipe.recv())
            pipe.send(None)
    except EOFError:
        return


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
    figures = in_one_process(envs, arguments, steps, rounds)
    if processes > 1:
        figures += in_processes(processes, envs, arguments, steps, rounds)
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
