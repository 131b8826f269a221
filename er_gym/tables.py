"""Tables of words and figures, and how they are written as Markdown and as CSV.

:func:`benchmarks.scoring.tables.print_tables` shows them in a terminal.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Cells as they are shown.

    Attributes:
        title: above the table.
        head: column names.
        rows: as wide as ``head``; where there are none, only the title is shown.
        text_columns: how many columns, from the left, hold words; the rest are figures.
        notes: lines below it.
        may_turn: whether the table may be transposed on a narrow terminal.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text_columns: int
    notes: tuple[str, ...] = ()
    may_turn: bool = False

    def markdown(self) -> str:
        """The cells alone, in GitHub's Markdown; "" without rows."""
        if not self.rows:
            return ""
        words, figures = self.text_columns, len(self.head) - self.text_columns
        rules = ("---",) * words + ("---:",) * figures
        return "\n".join(
            "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in row) + " |"
            for row in (self.head, rules, *self.rows)
        )

    def csv(self) -> str:
        """The cells alone, a line for each row."""
        out = io.StringIO()
        csv.writer(out, lineterminator="\n").writerows((self.head, *self.rows))
        return out.getvalue()


def as_markdown(tables: Sequence[Table]) -> str:
    """Tables with their titles and notes, in GitHub's Markdown."""
    return "\n".join(_titled(table) for table in tables)


def _titled(table: Table) -> str:
    notes = (f"\n{' '.join(note.split())}" for note in table.notes)
    parts = (f"**{' '.join(table.title.split())}**\n", table.markdown(), *notes)
    return "\n".join(filter(None, parts)) + "\n"
