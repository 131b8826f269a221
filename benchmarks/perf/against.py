"""Runs a measuring script of this checkout and of another commit in turn, and compares them."""

from __future__ import annotations

import json
import math
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import click

from benchmarks.harness.measuring import in_turns
from benchmarks.harness.output import FORMAT, ROOT, print_table
from benchmarks.harness.worktree import other_tree

LEAST_ROUNDS = 3
"""Fewer tell nothing of the noise."""
_LEAST_LOSS = 0.03
"""A smaller loss is not told, since with few rounds chance alone sets two sides apart now and
then."""
_MORE_IS_BETTER = "/s"
"""How a unit ends of which more is better; of others, such as ms and MiB, less is."""

Figures = dict[str, tuple[str, float]]
"""What a script measured: by the row's name its unit and value."""


@dataclass(frozen=True)
class Compared:
    """A row of both sides.

    Attributes:
        name, unit: of the row.
        then, now: what each round gave at the other commit and here.
    """

    name: str
    unit: str
    then: tuple[float, ...]
    now: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """How many times as good it is now, by the medians."""
        then, now = statistics.median(self.then), statistics.median(self.now)
        better, worse = (now, then) if self._more_is_better else (then, now)
        return better / worse if worse else math.nan

    @property
    def lost(self) -> bool:
        """Whether it is worse beyond the noise: each round is worse than all of the other side."""
        if self.ratio > 1 - _LEAST_LOSS:
            return False
        if self._more_is_better:
            return max(self.now) < min(self.then)
        return min(self.now) > max(self.then)

    @property
    def _more_is_better(self) -> bool:
        return self.unit.endswith(_MORE_IS_BETTER)


def compare(
    module: str, arguments: Sequence[str], commit: str, rounds: int, root: Path = ROOT
) -> list[Compared]:
    """Run ``python -m module`` in both trees, the sides in turn.

    Args:
        module: a script that writes :class:`~benchmarks.perf.steps.Measurement` with ``--json``.
        arguments: others of the script, for one round.
        commit: the other side's hash.
        rounds: how often each side runs; each is a process of its own.
        root: this side's checkout.

    Returns:
        The rows that both sides have, in the order of this one.

    Raises:
        click.ClickException: a side does not run, or writes no such figures.
    """
    with other_tree(commit, root) as tree:
        sides = {
            "then": partial(_figures, module, arguments, tree, f"the script of {commit[:12]}"),
            "now": partial(_figures, module, arguments, root, "this checkout's script"),
        }
        found = in_turns(sides, rounds)
    then, now = found["then"], found["now"]
    return [
        Compared(
            name,
            unit,
            *(tuple(figures[name][1] for figures in side) for side in (then, now)),
        )
        for name, (unit, _) in now[0].items()
        if all(name in figures for figures in (*then, *now))
    ]


def _figures(module: str, arguments: Sequence[str], tree: Path, whose: str) -> Figures:
    """What one process measured."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "figures.json"
        command = [sys.executable, "-m", module, *arguments, "--json", str(file)]
        ended = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=False)
        if ended.returncode:
            said = (ended.stderr or ended.stdout).strip().splitlines() or ["it says nothing"]
            raise click.ClickException(
                f"{whose} fails with exit code {ended.returncode}: {said[-1]}"
            )
        try:
            written = json.loads(file.read_text())
            rows = written["figures"] if written["format"] == FORMAT else []
            measured = {row["name"]: (row["unit"], float(row["value"])) for row in rows}
        except (OSError, ValueError, KeyError, TypeError):
            measured = {}
        if not measured:
            raise click.ClickException(f"{whose} writes no figures that this one reads")
        return measured


def show(rows: Sequence[Compared], commit: str) -> bool:
    """Print one table; returns whether anything is lost."""
    lost = [row for row in rows if row.lost]
    cells = [
        (
            row.name,
            f"{statistics.median(row.then):.4g}",
            f"{statistics.median(row.now):.4g}",
            row.unit,
            f"{row.ratio:.2f}",
            "worse" if row.lost else "",
            _spread(row.then),
            _spread(row.now),
        )
        for row in rows
    ]
    head = ("what", "then", "now", "unit", "times as good", "", "then: rounds", "now: rounds")
    notes = [
        f"'worse': at least {_LEAST_LOSS:.0%}, and each round now is worse than each round then.",
        f"{len(lost)} of {len(rows)} rows are worse.",
    ]
    print_table(f"this checkout beside {commit[:12]}", head, cells, notes=notes)
    return bool(lost)


def _spread(values: Sequence[float]) -> str:
    return f"{min(values):.4g} to {max(values):.4g}"
