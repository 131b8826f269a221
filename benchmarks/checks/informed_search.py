"""What a search reaches that knows in which places training tasks have each type of thing.

    python -m benchmarks.checks.informed_search [--suite er-val] [--trials 400]

It plays no episode: it counts steps. Each thing that a task fetches or looks for lies in one of the
room's places, and a search goes through the places in the order of how likely each is and how many
steps it takes: one to go there, one more to open it. Among places of a type all are alike. What is
left of the step limit after the key actions is what fruitless visits may take. So the figure says
how much of a suite is a matter of luck for an agent that forgets nothing and makes no mistake. Two
things are left out: what is seen from afar on the way makes a search shorter, and what cannot be
reached from where the agent stops makes it longer.
"""

from __future__ import annotations

import random
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from statistics import fmean
from typing import NamedTuple, TypeAlias

import click

from er_gym.sim.scene import load_scene
from er_gym.tables import Table, as_markdown
from er_gym.tasks import load_suite, verbs
from er_gym.tasks.task import Task, type_of_id
from er_gym.thor import OBJECT_TYPES

_UNKNOWN = 0.2
"""What a type of place counts in which training never has the thing, in tasks."""


class Hidden(NamedTuple):
    """A thing that must be found.

    Attributes:
        thing: its type.
        place: the type of the place where it is.
    """

    thing: str
    place: str


Habits: TypeAlias = Mapping[str, Mapping[str, int]]
"""By a thing's type: in how many tasks it is in a place of each type."""


def hidden_things(task: Task) -> list[Hidden]:
    """The things that a task fetches or looks for, each type once, where they first are."""
    found: dict[str, Hidden] = {}
    place = ""
    for action in task.key_actions:
        if action.verb == verbs.NAVIGATE:
            place = action.actual_type
        thing = action.actual_type if action.verb == verbs.PICKUP else ""
        if action.verb == verbs.END and task.type.search:
            thing = task.goal[0].object_type
        if thing:
            found.setdefault(thing, Hidden(thing, place))
    return list(found.values())


def habits(tasks: Iterable[Task]) -> Habits:
    """Where things are in tasks from which agents may learn."""
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for task in tasks:
        for thing, place in hidden_things(task):
            counts[thing][place] += 1
    return counts


def fruitless_steps(
    hidden: Hidden, places: Mapping[str, int], known: Habits, rng: random.Random
) -> int:
    """The steps that an informed search takes in places where the thing is not.

    Args:
        hidden: the thing; in which of the places of its type it is, is drawn.
        places: how many places of each type the room has.
    """
    at = known.get(hidden.thing, {})
    order = []
    for kind, count in places.items():
        steps = 1 + _opens(kind)
        each = (at.get(kind, 0) + _UNKNOWN) / count / steps
        order += [(each, rng.random(), kind, number, steps) for number in range(count)]
    is_in = rng.randrange(max(places.get(hidden.place, 0), 1))
    gone = 0
    for _, _, kind, number, steps in sorted(order, reverse=True):
        if (kind, number) == (hidden.place, is_in):
            break
        gone += steps
    return gone


def share_in_time(
    task: Task, places: Mapping[str, int], known: Habits, trials: int, rng: random.Random
) -> float:
    """In which share of trials the fruitless visits leave the steps for the key actions, 0 to 1."""
    things = hidden_things(task)
    spare = task.type.max_steps - len(task.key_actions)
    return fmean(
        sum(fruitless_steps(each, places, known, rng) for each in things) <= spare
        for _ in range(trials)
    )


@cache
def room_places(scene: str) -> Mapping[str, int]:
    """How many receptacles of each type a room has that cannot be carried about."""
    return Counter(
        kind for name in load_scene(scene).object_ids if _stays(kind := type_of_id(name))
    )


def _stays(kind: str) -> bool:
    properties = OBJECT_TYPES[kind].properties if kind in OBJECT_TYPES else ()
    return "receptacle" in properties and "pickupable" not in properties


def _opens(kind: str) -> bool:
    return "openable" in OBJECT_TYPES[kind].properties


def table(suite: str, tasks: Sequence[Task], known: Habits, trials: int) -> Table:
    """The shares by type of task, in %."""
    rng = random.Random(0)
    shares: defaultdict[str, list[float]] = defaultdict(list)
    for task in tasks:
        share = share_in_time(task, room_places(task.scene), known, trials, rng)
        for row in (task.type.title, "all"):
            shares[row].append(100 * share)
    last = {"all": shares.pop("all")}
    rows = tuple(
        (name, str(len(of)), f"{fmean(of):.1f}") for name, of in {**shares, **last}.items()
    )
    return Table(f"{suite}: informed search, in %", ("Type", "Tasks", "In time"), rows, 1)


@click.command(help=__doc__)
@click.option("--suite", "suites", multiple=True, default=["er-val", "er-1k"], show_default=True)
@click.option("--trials", default=400, show_default=True, help="Draws for each task.")
def main(suites: tuple[str, ...], trials: int) -> None:
    known = habits(load_suite("train").tasks)
    tables = [table(suite, load_suite(suite).tasks, known, trials) for suite in suites]
    click.echo(as_markdown(tables))


if __name__ == "__main__":
    main()
