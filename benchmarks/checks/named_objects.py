"""Checks that instructions name the things that their tasks are about, and no others.

    python -m benchmarks.checks.named_objects [SUITE …]

Every task is read as its suite tells it, and in Chinese. A type is named by any of the names that
instructions are made from (:mod:`er_gym.tasks.wordings.names`); a word that no table has names
nothing. Prints every instruction that names too little or too much; the exit code is 1 if there is
one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import click

from benchmarks.harness.tally import end, tally
from er_gym.tables import Table
from er_gym.tasks import verbs
from er_gym.tasks.suites import own_tasks, suite_names
from er_gym.tasks.task import Task
from er_gym.tasks.wordings.instructions import LANGUAGES, in_language
from er_gym.tasks.wordings.names import types_named_in

_BY_THE_WAY = frozenset({verbs.OPEN, verbs.CLOSE})
"""What is done to a receptacle because of what lies in it: no instruction asks for it."""


@dataclass(frozen=True)
class Named:
    """What an instruction names, compared with what its task is about.

    Attributes:
        task: with the instruction.
        language: of the instruction.
        lacking: the types that the task is about and the instruction does not name.
        foreign: the types that it names and the task is not about.
    """

    task: Task
    language: str
    lacking: frozenset[str]
    foreign: frozenset[str]

    @property
    def problems(self) -> list[str]:
        """What is wrong with it, in words."""
        said = {"does not name": self.lacking, "names, for no reason,": self.foreign}
        return [
            f"{self.task.instruction!r} {what} {', '.join(sorted(kinds))}"
            for what, kinds in said.items()
            if kinds
        ]


def about(task: Task) -> frozenset[str]:
    """The types that an instruction must name, from the task's goal and key actions alone.

    They are those of the goal's conditions, with the receptacles in which things must end up; those
    that the key actions handle, apart from opening and closing; and, where the goal asks for one
    object among others of its type, that of the place to which the key actions go for it.
    """
    kinds = {kind for each in task.goal for kind in (each.object_type, each.inside)}
    to_tell_apart, place = set(task.named), ""
    for key in task.key_actions:
        if key.verb == verbs.NAVIGATE:
            place = key.actual_type
        elif key.verb in verbs.INTERACTIONS and key.verb not in _BY_THE_WAY:
            kinds.add(key.actual_type)
            if key.object_id in to_tell_apart:
                to_tell_apart.remove(key.object_id)
                kinds.add(place)
    return frozenset(kinds - {""})


def named(task: Task, language: str = "en") -> Named:
    """What the task's instruction names."""
    said, meant = types_named_in(task.instruction), about(task)
    return Named(task, language, meant - said, said - meant)


def named_in(suite: str) -> Iterator[Named]:
    """What the instructions of one of er-gym's own suites name, in one language after the other."""
    for language in LANGUAGES:
        for task in in_language(own_tasks(suite), language):
            yield named(task, language)


def naming_table(suites: Sequence[str]) -> Table:
    """How many instructions of each suite name just what their tasks are about."""
    rows = []
    for suite in suites:
        found = [*named_in(suite)]
        for language in LANGUAGES:
            mine = [one for one in found if one.language == language]
            exact = sum(not one.problems for one in mine)
            few, many = (
                sum(bool(one.lacking) for one in mine),
                sum(bool(one.foreign) for one in mine),
            )
            rows.append((suite, language, f"{len(mine):,}", f"{exact:,}", f"{few:,}", f"{many:,}"))
    head = ("Suite", "Language", "Tasks", "Exactly", "Too little", "Too much")
    return Table("Instructions by what they name", head, tuple(rows), 2)


@click.command(help=f"\b\n{__doc__}")
@click.argument("suites", nargs=-1, type=click.Choice(suite_names()), metavar="[SUITE]...")
def main(suites: tuple[str, ...]) -> None:
    end(
        tally(
            "instructions",
            (
                (f"{suite}, {one.task.id}", one.problems)
                for suite in suites or suite_names()
                for one in named_in(suite)
            ),
        )
    )


if __name__ == "__main__":
    main()
