"""Reports as tables for people, and tables on the terminal."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from textwrap import fill

from rich import box
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from benchmarks.scoring.metrics import METRICS, TIDY, Estimate, Score
from benchmarks.scoring.report import (
    BOTH,
    RunReport,
    between_arrangements,
    by_group,
    sample_slices,
    slices,
)
from benchmarks.scoring.samples import most_samples
from benchmarks.terminal import without_control_codes
from er_gym.envs.protocol import DEFAULT
from er_gym.tables import Table
from er_gym.tasks.side_effects import KINDS
from er_gym.tasks.types import BY_NAME, GROUPS

NONE = "-"
"""A cell without a figure."""
_MOST_IN_FULL = 4
"""Of more runs and scorers at once, each has no table of its own."""
_WORDS_WIDTH = 18
"""Columns of words are not folded to less than this many characters."""
_GAP = 2
_BY_ARRANGEMENT = "Success, by arrangement"
_ALIKE = (
    "By arrangement of the rooms, of which there are n: the interval for other ones of these rooms"
)


def tables(
    runs: Sequence[RunReport],
    *,
    scorer: str = BOTH,
    with_types: bool = False,
    with_misses: bool = False,
) -> list[Table]:
    """The tables of a report: one of all runs, one of their side effects if their records tell
    them, and up to four runs one of each with all metrics.

    Args:
        runs: a line each, or one for each scorer where the scorers differ.
        scorer: one of ``report.SCORER_CHOICES``.
        with_types: add a table per run of every metric for each group and task type.
        with_misses: add a table per run of the episodes without success, under ``corrected``.
    """
    found = [_overview(runs, scorer), *_side_effects(runs)]
    found += [
        _samples(run, name, scores, with_types)
        for run in runs
        for name, scores in run.shown(scorer).items()
        if most_samples(scores) > 1
    ]
    if with_types:
        found += [
            _types(run, name, scores)
            for run in runs
            for name, scores in run.shown(scorer).items()
            if scores
        ]
    if with_misses:
        found += [_misses(run) for run in runs]
    shown = [(run, name, scores) for run in runs for name, scores in run.shown(scorer).items()]
    if len(shown) <= _MOST_IN_FULL:
        found += [_metrics(*each) for each in shown if each[2]]
    return found


def _overview(runs: Sequence[RunReport], scorer: str) -> Table:
    """The columns of the paper's result table, in its order, and tidy success if a run tells it.

    Suite, protocol and scorer are columns only where they differ, else part of the title. The title
    omits the default protocol.
    """
    tidy = any(each.side_effects is not None for run in runs for each in run.episodes)
    head = (
        *("Agent", "Suite", "Protocol", "Scorer", "n", "Success", "95 %"),
        *("Tidy success",) * tidy,
        *("Search efficiency", "Task completeness"),
        *GROUPS,
    )
    rows = [
        _overview_row(run, name, scores, tidy)
        for run in runs
        for name, scores in run.shown(scorer).items()
    ]
    constant = [column for column in (1, 2, 3) if len({row[column] for row in rows}) == 1]
    about = [
        f"{head[column].lower()} {rows[0][column]}"
        for column in constant
        if (column, rows[0][column]) != (2, DEFAULT.name)
    ]

    def rest(row: Sequence[str]) -> tuple[str, ...]:
        return tuple(cell for column, cell in enumerate(row) if column not in constant)

    return Table(
        title=", ".join(["Results", *about, "in %"]),
        head=rest(head),
        rows=tuple(rest(row) for row in rows),
        text_columns=4 - len(constant),
        notes=tuple(note for run in runs for note in _notes(run)),
        may_turn=True,
    )


def _overview_row(
    run: RunReport, scorer: str, scores: Sequence[Score], tidy: bool
) -> tuple[str, ...]:
    size = run.manifest.suite_size
    tasks = len({each.task_id for each in scores})
    n = str(size) if tasks == size else f"{tasks}/{size}"
    if len(scores) > tasks:
        n = f"{len(scores)} of {n}"
    head = (run.manifest.agent, run.manifest.suite, run.manifest.protocol, scorer, n)
    if not scores:
        return (*head, *[NONE] * (4 + tidy + len(GROUPS)))
    groups = by_group(scores)
    overall = slices(scores)[0][2]
    return (
        *head,
        percent(overall["success"].mean),
        interval(overall["success"]),
        *(percent_if_told(overall.get(TIDY)),) * tidy,
        percent(overall["search_efficiency"].mean),
        percent(overall["completeness"].mean),
        *(percent(groups[name]["success"].mean) if name in groups else NONE for name in GROUPS),
    )


def _metrics(run: RunReport, scorer: str, scores: Sequence[Score]) -> Table:
    """Every metric with its interval, and success by group."""
    whole = slices(scores)[0][2]
    known = [name for name in (METRICS[0], TIDY, *METRICS[1:]) if whole.get(name)]
    lines = [(name.replace("_", " ").capitalize(), whole.n, whole[name]) for name in known]
    lines += [
        (f"Success: {group}", summary.n, summary["success"])
        for group, summary in by_group(scores).items()
    ]
    between = ", between tasks" if most_samples(scores) > 1 else ""
    alike = between_arrangements(run.episodes, scores)
    if alike is not None:
        lines.insert(1, (_BY_ARRANGEMENT, alike.arrangements, alike.success))
    return Table(
        title=f"{run.path}, scorer {scorer}: every metric, in %",
        head=("", "n", "Mean", "95 %"),
        rows=tuple(
            (name, str(n), percent(estimate.mean), interval(estimate))
            for name, n, estimate in lines
        ),
        text_columns=1,
        notes=(
            f"95 %: Wilson's interval of success{' and tidy success' * (TIDY in known)}, 1.96 "
            f"standard errors{between} of the others",
            *(_ALIKE,) * (alike is not None),
        ),
    )


def _side_effects(runs: Sequence[RunReport]) -> list[Table]:
    """What the agents changed that no task asked for; nothing if no record tells."""
    rows = []
    for run in runs:
        told = [each.side_effects for each in run.episodes if each.side_effects is not None]
        if not told:
            continue
        kinds = Counter(effect.partition(" ")[0] for effects in told for effect in effects)
        means = (kinds.total(), *(kinds[kind] for kind in KINDS))
        without = sum(not effects for effects in told) / len(told)
        figures = (f"{number / len(told):.2f}" for number in means)
        rows.append((run.manifest.agent, str(run.path), str(len(told)), percent(without), *figures))
    if not rows:
        return []
    return [
        Table(
            title="Side effects: objects an episode that the task did not ask to change",
            head=("Agent", "Run", "n", "None, in %", "All", *(kind.capitalize() for kind in KINDS)),
            rows=tuple(rows),
            text_columns=2,
            may_turn=True,
        )
    ]


def _samples(run: RunReport, scorer: str, scores: Sequence[Score], with_types: bool) -> Table:
    """Success by task, where tasks were played several times."""
    lines = [
        (_name_of(level, name), counted)
        for level, name, counted in sample_slices(scores)
        if with_types or level != "type"
    ]
    _, whole = lines[0]
    number = len({each.task_id for each in scores})
    rest = number - whole.tasks
    return Table(
        title=f"{run.path}, scorer {scorer}: {whole.samples} samples of each task, in %",
        head=("", "Tasks", *(f"pass@{k}" for k in whole.pass_at), "Always"),
        rows=tuple(
            (
                name,
                str(counted.tasks),
                *(percent(rate) for rate in counted.pass_at.values()),
                percent(counted.always),
            )
            for name, counted in lines
        ),
        text_columns=1,
        notes=(f"{rest} of {number} tasks have fewer samples and are not counted here",)
        * (rest > 0),
    )


def _name_of(level: str, name: str) -> str:
    """What tables call a slice."""
    return "All" if level == "overall" else BY_NAME[name].title if level == "type" else name


def _notes(run: RunReport) -> list[str]:
    notes = [f"{run.path}: {note}" for note in run.left_out]
    if run.differ:
        notes.append(
            f"{run.path}: the scorers differ in {len(run.differ)} of {len(run.episodes)} "
            f"episodes; er-gym report {shlex.quote(str(run.path))} --format json lists them as "
            "scorers_differ"
        )
    if run.without_targets:
        notes.append(
            f"{run.path}: {run.without_targets} of {len(run.episodes)} episodes are searches "
            "whose old records lack the search targets; the environment's own verdict is used"
        )
    if run.crashed:
        notes.append(
            f"{run.path}: {run.crashed} of {len(run.episodes)} episodes crashed and count as "
            "failures; running the same command again plays them again"
        )
    notes += [f"{run.path}: {words}" for words in run.causes_in_words]
    return notes


def _types(run: RunReport, scorer: str, scores: Sequence[Score]) -> Table:
    lines = [(_name_of(level, name), summary) for level, name, summary in slices(scores)]
    tidy = lines[0][1].get(TIDY) is not None
    rows = [
        (
            name,
            str(summary.n),
            percent(summary["success"].mean),
            interval(summary["success"]),
            *(percent_if_told(summary.get(TIDY)),) * tidy,
            *(percent(summary[metric].mean) for metric in METRICS[1:]),
        )
        for name, summary in lines
    ]
    return Table(
        title=f"{run.path}, scorer {scorer}, in %",
        head=(
            *("", "n", "Success", "95 %"),
            *("Tidy success",) * tidy,
            *(name.replace("_", " ").capitalize() for name in METRICS[1:]),
        ),
        rows=tuple(rows),
        text_columns=1,
    )


def _misses(run: RunReport) -> Table:
    rows = [
        (
            miss.task_id,
            miss.task_type,
            miss.scene,
            miss.end_reason,
            miss.feedback or NONE,
            ", ".join(miss.missing) or NONE,
        )
        for miss in run.misses
    ]
    return Table(
        title=f"{run.path}: {len(rows)} of {len(run.episodes)} episodes without success",
        head=("Task", "Type", "Scene", "Ended by", "Last feedback", "Key actions left"),
        rows=tuple(rows),
        text_columns=6,
    )


def percent(rate: float, digits: int = 2) -> str:
    """A rate in %."""
    return f"{100 * rate:.{digits}f}"


def percent_if_told(estimate: Estimate | None, digits: int = 2) -> str:
    """The mean of a rate in %, ``-`` for None."""
    return NONE if estimate is None else percent(estimate.mean, digits)


def interval(estimate: Estimate) -> str:
    """The 95 % interval of a rate in %, ``-`` if it has none."""
    if estimate.low is None or estimate.high is None:
        return NONE
    return f"{100 * estimate.low:.1f} to {100 * estimate.high:.1f}"


def signed(estimate: Estimate | None) -> tuple[str, str]:
    """A difference in % and its interval; ``-`` for None."""
    if estimate is None:
        return NONE, NONE
    return f"{100 * estimate.mean:+.1f}", interval(estimate)


def print_tables(found: Sequence[Table], console: Console) -> None:
    """Print the tables in the terminal's width: a table that may be transposed is transposed if it
    then fits; words are folded, figures never.
    """
    for table in map(_plain, found):
        if table.may_turn and _width(table) > console.width > _width(_turned(table)):
            table = _turned(table)
        console.print(Text(f"\n{table.title}", style="bold"), soft_wrap=True)
        if table.rows:
            console.print(_rich(table, console.width), crop=False)
        for note in table.notes:
            console.print(Text(note, style="dim"), soft_wrap=True)


def _plain(table: Table) -> Table:
    """The table as it is shown, so that columns are as wide as their words."""
    rows = tuple(tuple(map(without_control_codes, row)) for row in table.rows)
    return replace(table, head=tuple(map(without_control_codes, table.head)), rows=rows)


def _turned(table: Table) -> Table:
    """Rows for columns; the first column's cells are the head."""
    first, *others = zip(table.head, *table.rows, strict=True)
    return replace(table, head=("", *first[1:]), rows=tuple(others), text_columns=1)


def _widths(table: Table) -> list[int]:
    """The least width of each column: figures and their column names stay whole."""
    widths = []
    for column, cells in enumerate(zip(table.head, *table.rows, strict=True)):
        if column < table.text_columns:
            widths.append(min(max(map(len, cells)), _WORDS_WIDTH))
        else:
            widths.append(max(map(len, [*cells[0].split(), *cells[1:]]), default=0))
    return widths


def _width(table: Table) -> int:
    return sum(_widths(table)) + _GAP * (len(table.head) - 1)


def _rich(table: Table, room: int) -> RichTable:
    needed = _width(table)
    shown = RichTable(
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, _GAP - 1, 0, 0),  # the box draws one more
        # Still too wide: the terminal breaks the lines, but nothing is lost.
        width=needed if needed > room else None,
    )
    for column, (name, width) in enumerate(zip(table.head, _widths(table), strict=True)):
        if column < table.text_columns:
            shown.add_column(Text(name), min_width=width, overflow="fold")
        else:
            head = Text(fill(name, max(width, 1)))
            shown.add_column(head, min_width=width, no_wrap=True, justify="right")
    for row in table.rows:
        shown.add_row(*(Text(cell) for cell in row))
    return shown
