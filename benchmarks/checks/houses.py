"""Counts what generated houses promise: no problem in any, and tasks of all types that can be done.

    python -m benchmarks.checks.houses --count 1000 --played 60

Each house of ``--count`` is made, which checks it (:mod:`er_gym.houses.checks`). In the first
``--played`` of them up to ``--each`` tasks of each type are played by the solver.
"""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Iterable
from itertools import islice

import click
from rich.progress import track

from er_gym.envs.embodied_env import verification_env
from er_gym.envs.verify import Verifier
from er_gym.houses.generate import MOST_ROOMS, generate_house
from er_gym.houses.names import house_name
from er_gym.tables import Table
from er_gym.tasks.generate import Generator, generator_for
from er_gym.thor import make_controller


def tasks_done(room: Generator, verify: Verifier, each: int) -> Counter[str]:
    """How many of the first ``each`` tasks of each type the solver has done."""
    of_type = defaultdict(list)
    for task in room.tasks():
        of_type[task.type.name].append(task)
    return Counter(
        {
            kind: done
            for kind, tasks in of_type.items()
            if (done := sum(verify(task).solved for task in islice(tasks, each)))
        }
    )


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return sum(found) / max(len(found), 1)


@click.command()
@click.option("--count", default=1000, show_default=True)
@click.option("--played", default=60, show_default=True)
@click.option("--each", default=6, show_default=True)
@click.option("--seed", default=0, show_default=True)
def main(count: int, played: int, each: int, seed: int) -> None:
    """Make houses, play tasks in some, and print a table by number of rooms."""
    seconds: defaultdict[int, list[float]] = defaultdict(list)
    done: defaultdict[int, list[int]] = defaultdict(list)
    types: defaultdict[int, list[int]] = defaultdict(list)
    failed = []
    verify, controller = Verifier(verification_env()), make_controller(headless=True)
    for k in track(range(count), "houses", transient=True):
        rooms = 1 + k % MOST_ROOMS
        start = time.process_time()
        try:
            generate_house(seed + k, rooms)
        except RuntimeError as error:
            failed.append(f"{house_name(seed + k, rooms)}: {error}")
            continue
        seconds[rooms].append(time.process_time() - start)
        if k < played:
            room = generator_for(controller, house_name(seed + k, rooms), 0)
            found = tasks_done(room, verify, each)
            done[rooms].append(found.total())
            types[rooms].append(len(found))
    verify.close()
    controller.stop()
    rows = [
        (
            str(rooms),
            str(len(seconds[rooms])),
            f"{_mean(seconds[rooms]):.2f}",
            f"{max(seconds[rooms]):.2f}",
            f"{min(done[rooms], default=0):.0f}",
            f"{_mean(done[rooms]):.0f}",
            f"{min(types[rooms], default=0):.0f}",
        )
        for rooms in sorted(seconds)
    ]
    header = ("Rooms", "Houses", "CPU s, mean", "most", "Tasks done, least", "mean", "Types, least")
    click.echo(Table("Houses", header, tuple(rows), 1).markdown())
    for line in failed:
        click.echo(line)


if __name__ == "__main__":
    main()
