"""Draw and tabulate runs of ``er-gym reinforce`` beside each other, for docs/reinforcement.md.

    python -m benchmarks.pages.reinforcement runs/rl/* --by advantage.row

Runs that have the same value of the setting ``--by`` are one line: the mean, the lowest and the
highest of their seeds. Writes ``docs/images/reinforcement_episodes.png`` and ``…_seconds.png``, and
prints the table as Markdown.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from pathlib import Path
from statistics import fmean
from typing import Any

import click

from agents.reinforce.run_files import REINFORCING, ReinforceManifest, RunFiles
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.harness.output import ROOT
from benchmarks.scoring.curves import REINFORCED, draw_curves
from er_gym.tables import Table

VALIDATION = "validation/success"
_START = {"episodes": 0, "continued": 0, "seconds": 0.0}
_SUCCESSES = ("validation first", "last", "best", "while it learns")
_LAST = 10
"""The updates over which success while it learns is averaged."""


@dataclass(frozen=True)
class ReinforcedRun:
    """A run, finished or not.

    Attributes:
        path: its directory.
        manifest: what learns on which tasks.
    """

    path: Path
    manifest: ReinforceManifest

    @staticmethod
    def load(path: Path) -> ReinforcedRun:
        """Read it.

        Raises:
            ValueError: it is not a run directory.
        """
        return ReinforcedRun(path, REINFORCING.read(path))

    @cached_property
    def curve(self) -> list[dict[str, float]]:
        """The figures of each update; validation before the first is at no episodes. To continue
        an episode counts as one."""
        lines = [_START | line for line in RunFiles(self.path).metrics()]
        return [line | {"episodes": line["episodes"] + line["continued"]} for line in lines]

    @property
    def updates(self) -> int:
        """How many there were."""
        return int(self.curve[-1]["update"]) if self.curve else 0

    def setting(self, name: str) -> str:
        """The value of a setting such as ``advantage.row``.

        Raises:
            ValueError: there is none of this name.
        """
        settings: Any = self.manifest.settings
        try:
            return str(reduce(lambda part, key: part[key], name.split("."), settings))
        except (KeyError, TypeError):
            raise ValueError(
                f"{self.path} has no setting {name}; give one such as advantage.row"
            ) from None


def families_by(runs: Sequence[ReinforcedRun], name: str) -> dict[str, list[ReinforcedRun]]:
    """Runs with the same value of a setting, in the order in which they are given."""
    found: dict[str, list[ReinforcedRun]] = {}
    for run in runs:
        found.setdefault(run.setting(name), []).append(run)
    return found


def comparison(families: Mapping[str, Sequence[ReinforcedRun]], name: str) -> Table:
    """A row for each family: what its runs came to, of each seed."""
    return Table(
        "",
        (name, "updates", "episodes", "minutes", *_SUCCESSES),
        tuple((family, *_cells(runs)) for family, runs in families.items()),
        text_columns=1,
    )


def _cells(runs: Sequence[ReinforcedRun]) -> tuple[str, ...]:
    validated = [[each[VALIDATION] for each in run.curve if VALIDATION in each] for run in runs]
    learnt = [[each["success"] for each in run.curve if "success" in each][-_LAST:] for run in runs]
    return (
        _each(f"{run.updates:,}" for run in runs),
        _each(f"{run.curve[-1]['episodes']:,.0f}" if run.curve else "0" for run in runs),
        _each(f"{run.curve[-1]['seconds'] / 60:.0f}" if run.curve else "0" for run in runs),
        _each(_percent(values[:1]) for values in validated),
        _each(_percent(values[-1:]) for values in validated),
        _each(_percent([max(values)] if values else []) for values in validated),
        _each(_percent(values) for values in learnt),
    )


def _each(values: Iterable[str]) -> str:
    return ", ".join(values)


def _percent(values: Sequence[float]) -> str:
    return f"{100 * fmean(values):.1f}" if values else "-"


@click.command(help=__doc__)
@click.argument("directories", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--by", default="advantage.row", show_default=True, help="The setting compared.")
@click.option(
    "--out",
    default=ROOT / "docs" / "images",
    type=click.Path(file_okay=False, path_type=Path),
    help="Where the pictures are written.  [default: docs/images]",
)
@force_option
def main(directories: tuple[Path, ...], by: str, out: Path, force: bool) -> None:
    with bad_input():
        families = families_by([ReinforcedRun.load(each) for each in directories], by)
        pictures = draw_curves(families, out, REINFORCED, force=force)
    click.echo(comparison(families, by).markdown())
    click.echo(", ".join(map(str, pictures)), err=True)


if __name__ == "__main__":
    main()
