"""Measures what a run on Ray costs the driver, and what it gains.

    python -m benchmarks.perf.cluster [driver] [actors] [memory]

``driver``: jobs a second that one driver keeps going, with jobs of 2 ms by a few actors and jobs of
200 ms by 64 of them, beside what the actors alone would do. ``actors``: er-1k by the oracle in two
processes and in one, by two actors and by one, in turn, for state and for pictures: whole
runs, and episodes a second in the middle half, when all workers play; and beside them processes
that only play, with no driver: what the machine itself gains by a second one. ``memory``: the
driver's resident memory over 50,000 jobs.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

import click

from agents import NamedAgent, make_agent
from benchmarks.harness.measuring import in_turns, timed
from er_gym import __version__
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.cluster.actors import resident_memory
from er_gym.rollout.cluster.session import ray_backend
from er_gym.rollout.cluster.settings import RaySettings
from er_gym.rollout.events import read_events
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.play import play_episode
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.runner import run
from er_gym.rollout.worker_backend import LOCAL_BACKEND, WorkerBackend
from er_gym.tasks import load_suite

_KINDS = ("driver", "actors", "memory")


class Nap:
    """A job that takes a time and no processor; it returns its process."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    def __call__(self, job: int) -> int:
        time.sleep(self._seconds)
        return os.getpid()


@click.command()
@click.argument("kinds", nargs=-1, type=click.Choice(_KINDS))
@click.option("--episodes", default=1000, show_default=True, help="Of er-1k.")
@click.option("--picture-episodes", default=60, show_default=True)
@click.option("--rounds", default=3, show_default=True)
def main(kinds: Sequence[str], episodes: int, picture_episodes: int, rounds: int) -> None:
    """Measure."""
    for kind in kinds or _KINDS:
        if kind == "driver":
            _driver()
        elif kind == "memory":
            _memory()
        else:
            _actors(episodes, picture_episodes, rounds)


def _driver() -> None:
    for seconds, workers, jobs in ((0.002, 4, 20_000), (0.2, 64, 6_400)):
        with ray_backend(RaySettings(cpus=0.01, memory=2**28), print) as worker_backend:
            spent = _time(worker_backend, seconds, jobs, workers)
            ideal = jobs * seconds / workers
            print(
                f"{workers} workers, {jobs:,} jobs of {1000 * seconds:g} ms: {jobs / spent:,.0f} "
                f"a second, {ideal / spent:.1%} of the ideal"
            )


def _time(worker_backend: WorkerBackend, seconds: float, jobs: int, workers: int) -> float:
    """Seconds for so many jobs, from the moment when all workers have done one."""
    all_jobs = range(jobs + 100_000)
    results = worker_backend.run_jobs(partial(Nap, seconds), all_jobs, workers=workers)
    with closing(results):
        at_work: set[int] = set()
        while len(at_work) < workers:
            at_work.add(_process(next(results)))
        start = time.perf_counter()
        for _ in range(jobs):
            next(results)
        return time.perf_counter() - start


def _process(result: tuple[int, Any]) -> int:
    """The process that did a job."""
    return int(result[1])


def _memory() -> None:
    with ray_backend(RaySettings(cpus=0.01, memory=2**28), print) as worker_backend:
        told = []
        for done, _ in enumerate(
            worker_backend.run_jobs(partial(Nap, 0.0), range(50_000), workers=2), start=1
        ):
            if done % 10_000 == 0:
                told.append(f"{resident_memory() / 2**20:.0f}")
    print(f"driver over 50,000 jobs, MiB after each 10,000: {', '.join(told)}")


def _actors(episodes: int, picture_episodes: int, rounds: int) -> None:
    suite = load_suite("er-1k")
    kinds: tuple[tuple[str, str, int], ...] = (
        ("state", "text", episodes),
        ("pictures", "rgb+text", picture_episodes),
    )
    with ray_backend(RaySettings(), print) as ray:
        for name, obs_mode, number in kinds:
            tasks = suite.tasks[:: max(1, len(suite.tasks) // number)][:number]
            ways = {
                "two processes": partial(_play, tasks, obs_mode, LOCAL_BACKEND, 2),
                "one process": partial(_play, tasks, obs_mode, LOCAL_BACKEND, 1),
                "two actors": partial(_play, tasks, obs_mode, ray, 2),
                "one actor": partial(_play, tasks, obs_mode, ray, 1),
            }
            spent = in_turns(ways, rounds)
            alone = [
                median(_only_playing(tasks, obs_mode, processes) for _ in range(rounds))
                for processes in (1, 2)
            ]
            whole = {way: median(seconds for seconds, _ in each) for way, each in spent.items()}
            speed = {way: median(rate for _, rate in each) for way, each in spent.items()}
            told = ", ".join(f"{way} {whole[way]:.1f} s ({speed[way]:.1f}/s)" for way in ways)
            print(
                f"{name}, {number} episodes: {told}; two actors are "
                f"{speed['two actors'] / speed['one actor']:.2f} x one, two processes "
                f"{speed['two processes'] / speed['one process']:.2f} x one; actors take "
                f"{whole['two actors'] / whole['two processes'] - 1:+.1%} against processes; two "
                f"processes that only play are {alone[1] / alone[0]:.2f} x one"
            )


def _only_playing(tasks: Sequence[Any], obs_mode: str, processes: int) -> float:
    """Episodes a second of processes that share the tasks and write nothing."""
    context = get_context("spawn")
    with context.Pool(processes) as pool:
        parts = [(tasks[first::processes], obs_mode) for first in range(processes)]
        return sum(pool.starmap(_played, parts, chunksize=1))


def _played(tasks: Sequence[Any], obs_mode: str) -> float:
    """Episodes a second in the middle half of some."""
    env = EmbodiedEnv((), backend="embedded", obs_mode=obs_mode)
    ended = []
    for task in tasks:
        play_episode(env, make_agent("oracle"), task, 0)
        ended.append(time.perf_counter())
    return _middle_rate(ended)


def _middle_rate(ended: Sequence[float]) -> float:
    """Episodes a second in the middle half of some, by the times of their ends."""
    first, last = len(ended) // 4, 3 * len(ended) // 4
    return (last - first) / (ended[last] - ended[first])


def _play(
    tasks: Sequence[Any], obs_mode: str, worker_backend: WorkerBackend, workers: int
) -> tuple[float, float]:
    """Seconds of a run; and episodes a second in its middle half, when all workers play."""
    manifest = Manifest(
        suite="er-1k",
        suite_digest="",
        suite_size=len(tasks),
        agent="oracle",
        env={"backend": "embedded", "obs_mode": obs_mode},
        seed=0,
        er_gym=__version__,
    )
    with tempfile.TemporaryDirectory() as folder:
        directory = RunDirectory.create(Path(folder) / "run", manifest)
        size = replace(Parallelism(workers), worker_backend=worker_backend)
        play = partial(run, directory, tasks, NamedAgent("oracle"), parallelism=size)
        spent = timed(play).clock
        ended = [event.time for event in read_events(directory.path, ["episode_ended"])]
        return spent, _middle_rate(ended)


if __name__ == "__main__":
    main()
