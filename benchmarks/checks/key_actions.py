"""Compare the generator's key actions with the paper's, task by task.

``python -m benchmarks.checks.key_actions FILE`` asks the generator
for a task of the same scene and type about the same objects as each task of the file, and compares
verbs and object types in order. Long-range tasks, which follow no rule, are left out. It also
counts the tasks that the generator enumerates by itself.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import click

from er_gym.tasks import verbs
from er_gym.tasks.generate import Generator
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.resolve import resolve_tasks
from er_gym.tasks.task import Task
from er_gym.tasks.types import COMPOSITE
from er_gym.thor import make_controller


@dataclass(frozen=True)
class Comparison:
    """A task of the paper and ours about the same objects.

    Attributes:
        theirs, ours: key actions as ``"verb Type"``.
        problem: why there is no task of ours. enumerated: whether the generator enumerates the same
            task by itself.
    """

    task: Task
    theirs: tuple[str, ...]
    ours: tuple[str, ...] = ()
    problem: str = ""
    enumerated: bool = False

    @property
    def same(self) -> bool:
        """Whether their key actions agree."""
        return self.theirs == self.ours


def labels(task: Task) -> tuple[str, ...]:
    """Verb and object type of each key action."""
    return tuple(f"{key.verb} {key.actual_type}".strip() for key in task.key_actions)


def asked(task: Task) -> list[str]:
    """Ids of the objects of a task: those that are taken, filled and switched, else those searched
    for.
    """
    handled = [
        key.object_id
        for key in task.key_actions
        if key.verb in (verbs.PICKUP, verbs.PUT, verbs.TOGGLE)
    ]
    return handled or list(task.related_objects[:1])


def compare(tasks: Iterable[Task]) -> list[Comparison]:
    """Ask the generator for each task, in the scene as recorded."""
    found = []
    generators: dict[str, Generator] = {}
    candidates: dict[str, set[tuple[str, tuple[str, ...]]]] = {}
    with make_controller(headless=True) as controller:
        for task in tasks:
            if task.scene not in generators:
                objects = controller.reset(task.scene).metadata["objects"]
                generators[task.scene] = generator = Generator(task.scene, objects)
                candidates[task.scene] = {(t.type.name, labels(t)) for t in generator.tasks()}
            try:
                ours = labels(generators[task.scene].request(task.type.name, *asked(task)))
            except ValueError as error:
                found.append(Comparison(task, labels(task), problem=str(error)))
                continue
            enumerated = (task.type.name, labels(task)) in candidates[task.scene]
            found.append(Comparison(task, labels(task), ours, enumerated=enumerated))
    return found


@click.command(help=__doc__)
@click.argument("path", type=click.Path(exists=True, dir_okay=False, path_type=Path))
def main(path: Path) -> None:
    """Print the differences and the number of tasks that agree."""
    tasks = resolve_tasks(read_tasks(path)).tasks
    compared = compare(t for t in tasks if t.type.group != COMPOSITE or t.type.ordered)
    for one in compared:
        if not one.same:
            click.echo(f"{one.task.id} {one.task.scene} {one.task.type.name}")
            click.echo(f"  theirs: {'; '.join(one.theirs)}")
            click.echo(f"  ours:   {one.problem or '; '.join(one.ours)}")
    same = sum(one.same for one in compared)
    enumerated = sum(one.enumerated for one in compared)
    click.echo(f"{same} of {len(compared)} agree ({100 * same / len(compared):.1f} %)")
    click.echo(f"the generator enumerates {enumerated} of them by itself")


if __name__ == "__main__":
    main()
