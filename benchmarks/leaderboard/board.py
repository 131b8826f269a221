"""The rows of the leaderboard, and which of them compare."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from benchmarks.leaderboard.checking import Checked
from benchmarks.leaderboard.columns import COLUMNS, REFERENCE, SUCCESS, Cell, Facts, kind_of
from benchmarks.leaderboard.submission import Header
from benchmarks.scoring.metrics import score_episode, summarise
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.study.paper_rungs import PAPER
from er_gym.tasks.suites import suite_names, suite_version
from er_gym.tasks.types import GROUPS


@dataclass(frozen=True)
class Row:
    """A row of the board.

    Attributes:
        suite: the title of its table: rows of other suites do not compare.
        instances: ``--instances``: rows with others do not compare either.
        reference: whether it is no competitor.
        cells: one for each of :data:`COLUMNS`.
    """

    suite: str
    instances: str
    reference: bool
    cells: tuple[Cell, ...]

    def __getitem__(self, title: str) -> Cell:
        return next(
            cell for column, cell in zip(COLUMNS, self.cells, strict=True) if column.title == title
        )


def row(checked: Checked, months: Mapping[str, str]) -> Row:
    """The row of a submission that has no problem.

    Args:
        checked: it.
        months: the name of a suite of fresh tasks to the month of which it is.
    """
    assert checked.submission is not None
    header = checked.submission.header
    scores = tuple(score_episode(each, CORRECTED) for each in checked.episodes)
    facts = Facts(header, checked, scores, summarise(scores))
    return Row(
        suite=_suite(header, months),
        instances=str(facts.env.get("instances", "target")),
        reference=kind_of(facts) == REFERENCE,
        cells=tuple(each.cell(facts) for each in COLUMNS),
    )


def _suite(header: Header, months: Mapping[str, str]) -> str:
    name = header.manifest.suite
    if name in months:
        return f"{name} (held out, {months[name]})"
    if name.removesuffix("-zh") not in suite_names():
        return f"{name} (no month's)"
    version = suite_version(name, header.manifest.suite_digest)
    return name if version is None else f"{name}, version {version}"


PAPER_HEAD = (
    *("Model", SUCCESS, "Search efficiency, %", "Completeness, %"),
    *(f"{name}, %" for name in GROUPS),
)


def paper_rows() -> Iterator[tuple[Cell, ...]]:
    """The paper's published table, which was measured elsewhere."""
    for rung in PAPER.values():
        figures = (rung.success, rung.search_efficiency, rung.completeness, *rung.groups)
        yield (Cell(rung.name), *(Cell(f"{each:.2f}", each) for each in figures))
