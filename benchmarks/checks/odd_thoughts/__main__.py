"""The command of the search for odd thoughts."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import click

from benchmarks.checks.odd_thoughts import __doc__ as doc
from benchmarks.checks.odd_thoughts.kinds import GUESS, KINDS, oddities
from benchmarks.checks.odd_thoughts.of_words import closer
from benchmarks.harness.output import json_option, print_table, progress, write_figures
from er_gym.data.collection import Collection
from er_gym.data.trajectory import Trajectory

CLOSERS = 6


@dataclass
class Found:
    """What was found.

    Attributes:
        parts: how many trajectories each part has.
        odd: by kind and part, how many trajectories have it.
        examples: by kind, where and what.
        closers: how often each ends an episode.
    """

    parts: Counter[str] = field(default_factory=Counter)
    odd: dict[str, Counter[str]] = field(default_factory=lambda: defaultdict(Counter))
    examples: dict[str, list[str]] = field(default_factory=lambda: defaultdict(list))
    closers: Counter[str] = field(default_factory=Counter)

    @property
    def closed(self) -> int:
        """How many episodes end with one of the most frequent closers."""
        return sum(number for _, number in self.closers.most_common(CLOSERS))


def search(trajectories: Iterable[Trajectory]) -> Found:
    """Search trajectories for all kinds."""
    found = Found()
    for each in trajectories:
        found.parts[each.part] += 1
        found.closers[closer(each)] += 1
        for kind, examples in oddities(each):
            if examples:
                found.odd[kind][each.part] += 1
                found.examples[kind] += [f"{each.id}: {one}" for one in examples]
    return found


@click.command(help=f"\b\n{doc}")
@click.argument("directories", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--show", default=3, show_default=True, help="How many of each kind to print.")
@json_option
def main(directories: tuple[Path, ...], show: int, file: Path | None) -> None:
    figures = {}
    for directory in directories:
        whole = list(Collection.open(directory).trajectories())
        found = search(progress(whole, str(directory)))
        parts, total = sorted(found.parts), found.parts.total()
        rows = [
            (kind, *(found.odd[kind][part] for part in parts), found.odd[kind].total())
            for kind in (GUESS, *KINDS)
        ]
        rows.append(
            (f"one of the {CLOSERS} most frequent closers", *("" for _ in parts), found.closed)
        )
        head = ("Trajectories with", *(f"{part} ({found.parts[part]})" for part in parts))
        print_table(str(directory), (*head, f"all ({total})"), rows)
        for kind in (GUESS, *KINDS):
            for example in found.examples[kind][:show]:
                click.echo(f"{kind}: {example}")
        for text, number in found.closers.most_common(CLOSERS if show else 0):
            click.echo(f"{number} end: {text}")
        figures[str(directory)] = {
            "trajectories": total,
            **{kind: found.odd[kind].total() for kind in (GUESS, *KINDS)},
            "closers": found.closed,
        }
    write_figures(file, figures)


if __name__ == "__main__":
    main()
