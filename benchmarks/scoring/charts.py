"""A suite's distributions as charts: PNG files, drawn with matplotlib."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.scoring.drawing import (
    bars,
    canvas,
    heat,
    legend_below,
    own_style,
    shades,
    stacks,
    write_charts,
)
from er_gym.tasks.difficulty import length
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.suite_card import Summary, summarise
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, GROUPS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BAR = 0.27
"""Inches from one bar to the next, wide enough for a name beside each."""
_TOP = 40
"""The most bars in a chart of object types."""

# Each chart keeps to one hue; steps differ in lightness, which every kind of eye tells apart.
_GROUPS = ("#a9d0ea", "#5ba3d0", "#2470ad", "#0b3a6b")
_OBJECTS, _RECEPTACLES = "#2a8c82", "#b5762a"


@own_style()
def draw_charts(tasks: Sequence[Task], out: Path, title: str, *, force: bool = True) -> list[Path]:
    """Draw how tasks are distributed over types, objects, receptacles, lengths and rooms.

    Args:
        out: the folder to draw into; made where it is missing.
        title: what the tasks are, such as the suite's name; every chart's title begins with it.
        force: whether to replace also files of the same names that er-gym did not write; without
            it, and where there is one, none is drawn.

    Returns:
        The files, ``types.png`` first.

    Raises:
        ImportError: matplotlib is not installed.
        ValueError: there are no tasks.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    if not tasks:
        raise ValueError("there are no tasks to draw charts of; give at least one")
    summary = summarise(tasks)
    handled = f"{title}: tasks by type of the first object handled"
    gone_to = f"{title}: tasks that go to each type of receptacle"
    figures = {
        "types": _types(summary, title),
        "objects": _most_frequent(summary.subjects, _OBJECTS, handled, summary),
        "receptacles": _most_frequent(summary.receptacles, _RECEPTACLES, gone_to, summary),
        "lengths": _lengths(tasks, summary, title),
        "rooms": _rooms(tasks, summary, title),
    }
    return write_charts(out, figures, force=force)


def _types(summary: Summary, title: str) -> Figure:
    names = [BY_NAME[name].title for name in summary.types]
    colours = _group_colours()
    heading = f"{title}: tasks by type, n = {summary.tasks:,}"
    figure, axes = canvas(9.6, 1.6 + _BAR * 1.2 * len(names), heading)
    own = [colours[BY_NAME[name].group] for name in summary.types]
    bars(axes, names, [([*summary.types.values()], own)], ",")
    legend_below(figure, {_told(group, summary): colours[group] for group in summary.groups})
    return figure


def _most_frequent(
    counts: Mapping[str, int], colour: str, heading: str, summary: Summary
) -> Figure:
    shown = dict(islice(counts.items(), _TOP))
    which = f"the top {len(shown)} of {len(counts)} types" if len(shown) < len(counts) else ""
    heading = ", ".join(filter(None, [heading, which, f"n = {summary.tasks:,}"]))
    figure, axes = canvas(8.6, 1.3 + _BAR * 0.9 * max(len(shown), 3), heading)
    bars(axes, [*shown], [([*shown.values()], colour)], ",")
    return figure


def _lengths(tasks: Sequence[Task], summary: Summary, title: str) -> Figure:
    lengths = range(min(summary.lengths), max(summary.lengths) + 1)
    counts = Counter((task.type.group, length(task)) for task in tasks)
    colours = _group_colours()
    return stacks(
        f"{title}: tasks by number of key actions, n = {summary.tasks:,}",
        "key actions",
        lengths,
        [
            (_told(group, summary), colours[group], [counts[group, number] for number in lengths])
            for group in summary.groups
        ],
        totals=True,
    )


def _rooms(tasks: Sequence[Task], summary: Summary, title: str) -> Figure:
    counts = Counter((task.type.name, room_kind(task.scene)) for task in tasks)
    heading = f"{title}: tasks by type and kind of room, n = {summary.tasks:,}"
    figure, axes = canvas(9.2, 1.6 + _BAR * 1.3 * len(summary.types), heading)
    heat(
        axes,
        [[counts[name, kind] for kind in summary.room_kinds] for name in summary.types],
        [f"{BY_NAME[name].title}  {n:,}" for name, n in summary.types.items()],
        [f"{kind}\n{n:,}" for kind, n in summary.room_kinds.items()],
    )
    return figure


def _group_colours() -> dict[str, str]:
    """A shade for each group, light to dark."""
    return dict(zip(GROUPS, shades(_GROUPS, len(GROUPS)), strict=True))


def _told(group: str, summary: Summary) -> str:
    return f"{group} ({summary.groups[group]:,})"
