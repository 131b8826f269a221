"""Checks that an episode that is saved goes on elsewhere as it does here, to the byte.

    python -m benchmarks.checks.same_forks [--forks 10000] [--json FILE]

Episodes are played as in ``same_steps``: every type of task, several suites, all kinds of
observations, pictures among them, both protocols, faults. Before each step the episode is saved,
and another environment goes back to it, which in an episode's beginning is in another room. What it
tells is compared, and then what the next step tells: observations, rewards, ends, ``info`` and the
details. In each episode one fork plays to the end. Times are of the processor.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.checks.same_steps import CASES, Case, Digest, choose
from benchmarks.harness.output import json_option, print_table, progress, write_figures
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.solver import Solver
from er_gym.tasks.types import TASK_TYPES

_FORKED = 4
"""The step before which one fork is made that plays to the end."""


class Episode:
    """An episode with its forks.

    Attributes:
        forks: how many there were.
        apart: what differed, a sentence each.
        saving, restoring: seconds each.
        sizes: bytes each.
    """

    def __init__(self, case: Case, env: EmbodiedEnv, twin: EmbodiedEnv, seed: int) -> None:
        self.forks, self.apart = 0, list[str]()
        self.saving, self.restoring, self.sizes = list[float](), list[float](), list[int]()
        self._name = f"{case.name}, seed {seed}"
        self._play(case, env, twin, seed)

    def _play(self, case: Case, env: EmbodiedEnv, twin: EmbodiedEnv, seed: int) -> None:
        random, solver, long = np.random.default_rng([39, seed]), Solver(), None
        told: tuple[Any, ...] = env.reset(seed=seed)
        steps, over = 0, False
        while not over:
            again = self._restore(env, twin)
            self._compare(told, again, env, twin, f"restored at step {steps}")
            if steps == _FORKED:
                (long,) = env.fork(1)
            action = choose(env, case, solver, random, told[-1])
            told, other = env.step(action), twin.step(action)
            steps, over = steps + 1, told[2] or told[3]
            self._compare(told, other, env, twin, f"gone on at step {steps}")
            if long is not None:
                self._compare(told, long.step(action), env, long, f"forked, at step {steps}")
        self._compare(told, self._restore(env, twin), env, twin, "restored at the end")
        if long is not None:
            long.close()

    def _restore(self, env: EmbodiedEnv, twin: EmbodiedEnv) -> tuple[Any, ...]:
        began = time.process_time()
        saved = env.snapshot()
        between = time.process_time()
        again = twin.restore(saved)
        self.saving.append(between - began)
        self.restoring.append(time.process_time() - between)
        self.sizes.append(len(saved))
        self.forks += 1
        if twin.snapshot() != saved:
            self.apart.append(f"{self._name}: a snapshot of what was restored is another one")
        return again

    def _compare(
        self, one: Any, other: Any, env: EmbodiedEnv, twin: EmbodiedEnv, where: str
    ) -> None:
        # A restored step has no reward and no ends: reset's form, as step's ends in it.
        digests = []
        for told, own in ((one, env), (other, twin)):
            digest = Digest()
            ends = told[1:4] if len(one) == len(other) == 5 else ()
            digest.add((told[0], told[-1], ends, own.details, vars(own.agent_pose)))
            digests.append(digest.text())
        if digests[0] != digests[1]:
            self.apart.append(f"{self._name}: {where}")


def episodes(forks: int) -> Iterator[Episode]:
    """Episodes of each case and type in turn, until there have been so many forks."""
    total = sum(case.steps for case in CASES)
    for case in CASES:
        for number, kind in enumerate(TASK_TYPES):
            env, twin = (
                EmbodiedEnv(case.suite, task_type=kind.name, **case.arguments) for _ in range(2)
            )
            wanted, done, seed = forks * case.steps / total / len(TASK_TYPES), 0, 1000 * number
            while done < wanted:
                episode = Episode(case, env, twin, seed)
                yield episode
                done, seed = done + episode.forks, seed + 1
            env.close()
            twin.close()


@click.command()
@click.option("--forks", default=10_000, show_default=True, type=click.IntRange(1))
@json_option
def main(forks: int, file: Path | None) -> None:
    """Fork episodes, and compare."""
    played = list(progress(episodes(forks), "episodes"))
    apart = [line for episode in played for line in episode.apart]
    for line in apart:
        click.echo(line)
    rows: list[tuple[str, ...]] = []
    for what, name, unit, scale in (
        ("snapshot()", "saving", "µs", 1e6),
        ("restore()", "restoring", "µs", 1e6),
        ("a snapshot", "sizes", "bytes", 1),
    ):
        values = [scale * value for episode in played for value in getattr(episode, name)]
        median, most = np.percentile(values, (50, 95))
        rows.append((what, f"{median:,.0f}", f"{most:,.0f}", unit))
    count = sum(episode.forks for episode in played)
    title = f"{count} forks in {len(played)} episodes: {len(apart)} differences"
    print_table(title, ("what", "median", "p95", "unit"), rows)
    write_figures(file, {"forks": count, "apart": apart, "rows": rows})
    sys.exit(1 if apart else 0)


if __name__ == "__main__":
    main()
