"""Counts what generated houses promise: no problem in any, and tasks of all types that can be done.

    python -m benchmarks.checks.houses --count 1000 --played 60

Each house of ``--count`` is made, which checks it (:mod:`er_gym.houses.checks`). In the first
``--played`` of them up to ``--each`` tasks of each type are played by the solver. ``--enough 30``
takes the types in turn, and leaves a house as soon as 30 tasks of eight types are done: that is
what a house promises, and takes half of the time.

Each house is a line in ``--work`` as soon as it is counted. The same command goes on there after a
kill, also with a larger ``--count`` or ``--played``; after a change to er-gym it is to be given
another folder.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import chain, islice, zip_longest
from pathlib import Path
from typing import Any

import click
from pydantic import BaseModel, ValidationError
from rich.progress import track

from benchmarks.cli.errors import entered
from er_gym.envs.embodied_env import verification_env
from er_gym.envs.verify import Verifier
from er_gym.houses.generate import MOST_ROOMS, generate_house
from er_gym.houses.names import house_name
from er_gym.resumable import FolderKind, ResumableFolder, has_content
from er_gym.rollout.json_lines import JsonLines
from er_gym.tables import Table
from er_gym.tasks.generate import Generator, generated_types, generator_for
from er_gym.tasks.task import Task
from er_gym.thor import make_controller

TYPES = 8
"""Of how many types the tasks of a house are at least."""
_LINES = "houses.jsonl"


class Asked(BaseModel, frozen=True):
    """What is counted in a folder.

    Attributes:
        seed: of the first house.
        each: how many tasks of a type are played in a house.
        enough: after how many tasks that were done a house is left; 0 for never.
    """

    seed: int
    each: int
    enough: int


class House(BaseModel, frozen=True):
    """What was counted in a house: a line of the folder.

    Attributes:
        name, rooms: which house.
        seconds: processor time to make it.
        problem: why it could not be made, ``""`` if it could.
        played: processor time to find and play tasks, None if none were to be played.
        done: how many tasks of each type the solver has done.
    """

    name: str
    rooms: int
    seconds: float
    problem: str = ""
    played: float | None = None
    done: dict[str, int] = {}

    @property
    def tasks(self) -> int:
        """How many tasks the solver has done."""
        return sum(self.done.values())


class Counted(ResumableFolder[Asked]):
    """A folder of counted houses."""

    KIND = FolderKind(
        noun="count of houses",
        command="python -m benchmarks.checks.houses",
        manifest="houses.json",
        model=Asked,
        parts=(_LINES,),
        holds_something=lambda folder: has_content(folder / _LINES),
    )


def tasks_done(room: Generator, verify: Verifier, each: int, enough: int = 0) -> Counter[str]:
    """How many of the first ``each`` tasks of each type the solver has done.

    With ``enough``, types take turns, and the rest is left once so many tasks of :data:`TYPES`
    types are done.
    """
    done: Counter[str] = Counter()
    for task in _in_turn(islice(room.tasks([kind.name]), each) for kind in generated_types()):
        if enough and done.total() >= enough and len(done) >= TYPES:
            break
        if verify(task).solved:
            done[task.type.name] += 1
    return done


def _in_turn(streams: Iterable[Iterator[Task]]) -> Iterator[Task]:
    """The first task of each stream, then the second of each."""
    return (task for task in chain.from_iterable(zip_longest(*streams)) if task is not None)


def count_house(
    seed: int, rooms: int, asked: Asked, controller: Any, verify: Verifier | None
) -> House:
    """Make a house; play tasks in it if there is a verifier."""
    name, start = house_name(seed, rooms), time.process_time()
    try:
        generate_house(seed, rooms)
    except RuntimeError as error:
        return House(name=name, rooms=rooms, seconds=0.0, problem=str(error))
    made = time.process_time()
    house = House(name=name, rooms=rooms, seconds=made - start)
    if verify is None:
        return house
    room = generator_for(controller, name, 0)
    done = tasks_done(room, verify, asked.each, asked.enough)
    return house.model_copy(update={"played": time.process_time() - made, "done": dict(done)})


def _kept(lines: JsonLines) -> Iterator[House]:
    for line in lines.new():
        with suppress(ValidationError):  # half a line, after a full disk: it is counted again
            yield House.model_validate_json(line)


def _mean(values: Iterable[float]) -> float:
    found = list(values)
    return sum(found) / max(len(found), 1)


def table(houses: Iterable[House]) -> Table:
    """Time, tasks and types by number of rooms."""
    of_rooms: dict[int, list[House]] = {}
    for house in houses:
        if not house.problem:
            of_rooms.setdefault(house.rooms, []).append(house)
    rows = [(str(rooms), *_row(found)) for rooms, found in sorted(of_rooms.items())]
    header = (
        *("Rooms", "Houses", "CPU s, mean", "most"),
        *("Played", "CPU s, mean", "Tasks done, least", "mean", "Types, least"),
    )
    return Table("Houses", header, tuple(rows), 1)


def _row(houses: list[House]) -> tuple[str, ...]:
    seconds = [house.seconds for house in houses]
    played = [house for house in houses if house.played is not None]
    return (
        str(len(houses)),
        f"{_mean(seconds):.2f}",
        f"{max(seconds):.2f}",
        str(len(played)),
        f"{_mean(house.played or 0.0 for house in played):.2f}",
        str(min((house.tasks for house in played), default=0)),
        f"{_mean(house.tasks for house in played):.0f}",
        str(min((len(house.done) for house in played), default=0)),
    )


def _short(houses: Mapping[str, House], enough: int) -> Iterator[str]:
    """The houses that fall short, in words."""
    for house in houses.values():
        if house.problem:
            yield f"{house.name}: {house.problem}"
        elif house.played is not None and (house.tasks < enough or len(house.done) < TYPES):
            yield f"{house.name}: {house.tasks} tasks of {len(house.done)} types: {house.done}"


@click.command()
@click.option(
    "--count",
    default=1000,
    show_default=True,
    help="How many houses are made, of 1 to 6 rooms in turn.",
)
@click.option(
    "--played", default=60, show_default=True, help="In how many of these tasks are played."
)
@click.option(
    "--each",
    default=6,
    show_default=True,
    help="How many tasks of each type are played in a house.",
)
@click.option(
    "--enough",
    default=0,
    show_default=True,
    help=f"Leave a house once so many tasks of {TYPES} types are done; 0 plays all.",
)
@click.option("--seed", default=0, show_default=True, help="Of the first house.")
@click.option(
    "--work",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("runs/houses"),
    show_default=True,
    help="The folder that keeps what was counted; the same command goes on there.",
)
def main(count: int, played: int, each: int, enough: int, seed: int, work: Path) -> None:
    """Make houses, play tasks in some, and print a table by number of rooms.

    Houses that cannot be made, or that have too few tasks or types, stand below the table.
    """
    asked = Asked(seed=seed, each=each, enough=enough)
    with entered(lambda: Counted.locked(work, asked)):
        lines = JsonLines(work / _LINES)
        houses = {house.name: house for house in _kept(lines)}
        verify, controller = Verifier(verification_env()), make_controller(headless=True)
        for k in track(range(count), "houses", transient=True):
            rooms, plays = 1 + k % MOST_ROOMS, k < played
            house = houses.get(house_name(seed + k, rooms))
            if house is None or (plays and house.played is None and not house.problem):
                house = count_house(seed + k, rooms, asked, controller, verify if plays else None)
                lines.add(house.model_dump_json())
                houses[house.name] = house
        verify.close()
        controller.stop()
        lines.close()
    click.echo(table(houses.values()).markdown())
    for line in _short(houses, enough or 30):
        click.echo(line)


if __name__ == "__main__":
    main()
