"""What scripts print and write: progress, tables, and their figures as JSON."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click
from rich.console import Console
from rich.progress import track

from benchmarks.scoring.tables import print_tables
from benchmarks.terminal import terminal
from er_gym.tables import Table
from er_gym.writing import check_output, write_output

FORMAT = "er-gym/figures/1"
ROOT = Path(__file__).resolve().parents[2]
"""The checkout."""
SHARED = ROOT.parent / "shared" / "data"
"""The data that lie beside a checkout."""
_WIDTH = 120
"""Columns of what is printed into a file or a pipe."""

Item = TypeVar("Item")


class Output(click.Path):
    """A file to write, checked before anything is measured; files of other programs are not
    replaced.
    """

    def __init__(self) -> None:
        super().__init__(dir_okay=False, path_type=Path)

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """The path; click ends the script with exit code 2 if it cannot be written."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        try:
            check_output(path)
        except (OSError, ValueError) as error:
            self.fail(str(error), param, ctx)
        return path


json_option = click.option(
    "--json", "file", type=Output(), help="Also write the figures to this file."
)


def write_figures(file: Path | None, figures: object) -> None:
    """Write figures as JSON: ``{"format": "er-gym/figures/1", "figures": …}``; not without a file.

    Raises:
        click.ClickException: they cannot be written.
    """
    if file is None:
        return
    text = json.dumps({"format": FORMAT, "figures": figures}, indent=1) + "\n"
    try:
        write_output(file, text)
    except (OSError, ValueError) as error:
        raise click.ClickException(str(error)) from error


def console() -> Console:
    """The console of tables and texts: it prints literally, and wide where there is no terminal."""
    return terminal(width=None if sys.stdout.isatty() else _WIDTH)


def print_table(
    title: str,
    head: Sequence[str],
    rows: Iterable[Sequence[object]],
    *,
    words: int = 1,
    notes: Sequence[str] = (),
    to: Console | None = None,
) -> None:
    """Print a table.

    Args:
        title, head: above it, and the names of its columns.
        rows: their cells.
        words: how many columns, from the left, hold words; the rest are figures.
        notes: lines below it.
        to: the console, another than :func:`console`.
    """
    cells = tuple(tuple(map(str, row)) for row in rows)
    print_tables([Table(title, tuple(head), cells, words, tuple(notes))], to or console())


def progress(items: Iterable[Item], what: str, total: int | None = None) -> Iterable[Item]:
    """The items, with a bar on a terminal's stderr of how many have been taken."""
    error = Console(stderr=True)
    return track(items, what, total, console=error, disable=not error.is_terminal)
