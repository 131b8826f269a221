"""A suite's distributions as charts: PNG files, drawn with matplotlib."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.scoring.drawing import (
    DPI,
    HEAT,
    INK,
    MUTED,
    bars,
    canvas,
    count_axis,
    note,
    own_style,
    write_chart,
)
from er_gym.tasks.difficulty import length
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.suite_card import Summary, summarise
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, GROUPS
from er_gym.writing import check_output, make_folder

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
    make_folder(out)
    files = {out / f"{name}.png": figure for name, figure in figures.items()}
    for path in files:
        check_output(path, force=force)
    for path, figure in files.items():
        # "tight" grows the page to whatever sticks out of it: no label is cut.
        write_chart(path, figure, force=force, dpi=DPI, bbox_inches="tight", pad_inches=0.15)
    return list(files)


def _types(summary: Summary, title: str) -> Figure:
    names = [BY_NAME[name].title for name in summary.types]
    colors = _group_colors()
    heading = f"{title}: tasks by type, n = {summary.tasks:,}"
    figure, axes = canvas(9.6, 1.6 + _BAR * 1.2 * len(names), heading)
    bars(
        axes,
        names,
        list(summary.types.values()),
        [colors[BY_NAME[name].group] for name in summary.types],
    )
    _legend(figure, summary)
    return figure


def _most_frequent(counts: Mapping[str, int], color: str, heading: str, summary: Summary) -> Figure:
    shown = dict(islice(counts.items(), _TOP))
    which = f"the top {len(shown)} of {len(counts)} types" if len(shown) < len(counts) else ""
    heading = ", ".join(filter(None, [heading, which, f"n = {summary.tasks:,}"]))
    figure, axes = canvas(8.6, 1.3 + _BAR * 0.9 * max(len(shown), 3), heading)
    bars(axes, list(shown), list(shown.values()), [color] * len(shown))
    return figure


def _lengths(tasks: Sequence[Task], summary: Summary, title: str) -> Figure:
    lengths = range(min(summary.lengths), max(summary.lengths) + 1)
    counts = Counter((task.type.group, length(task)) for task in tasks)
    width = min(max(7.6, 1.4 + 0.5 * len(lengths)), 16.0)
    heading = f"{title}: tasks by number of key actions, n = {summary.tasks:,}"
    figure, axes = canvas(width, 4.8, heading)
    colors, below = _group_colors(), [0] * len(lengths)
    for group in summary.groups:
        heights = [counts[group, number] for number in lengths]
        axes.bar(lengths, heights, 0.8, below, color=colors[group], edgecolor="white", lw=0.6)
        below = [low + height for low, height in zip(below, heights, strict=True)]
    for number, total in zip(lengths, below, strict=True):
        if total:
            note(axes, f"{total:,}", (number, total), (0, 3), ha="center", va="bottom")
    axes.set_xticks(lengths)
    axes.set_xlim(lengths[0] - 0.7, lengths[-1] + 0.7)
    axes.set_xlabel("key actions", color=MUTED, fontsize=10)
    count_axis(axes, "y")
    _legend(figure, summary)
    return figure


def _rooms(tasks: Sequence[Task], summary: Summary, title: str) -> Figure:
    from matplotlib.colors import LinearSegmentedColormap

    kinds, types = list(summary.room_kinds), list(summary.types)
    counts = Counter((task.type.name, room_kind(task.scene)) for task in tasks)
    table = [[counts[name, kind] for kind in kinds] for name in types]
    heading = f"{title}: tasks by type and kind of room, n = {summary.tasks:,}"
    figure, axes = canvas(9.2, 1.6 + _BAR * 1.3 * len(types), heading)
    heat = LinearSegmentedColormap.from_list("heat", HEAT)
    most = max(map(max, table))
    axes.pcolormesh(table, cmap=heat, vmin=0, vmax=most, edgecolors="white", linewidth=2)
    for row, line in enumerate(table):
        for column, count in enumerate(line):
            color = "white" if count > 0.55 * most else INK if count else MUTED
            axes.text(column + 0.5, row + 0.5, f"{count:,}", ha="center", va="center", color=color)
    axes.set_xticks([column + 0.5 for column in range(len(kinds))])
    axes.set_xticklabels([f"{kind}\n{n:,}" for kind, n in summary.room_kinds.items()])
    axes.set_yticks([row + 0.5 for row in range(len(types))])
    axes.set_yticklabels([f"{BY_NAME[name].title}  {n:,}" for name, n in summary.types.items()])
    axes.invert_yaxis()
    axes.xaxis.tick_top()
    return figure


def _group_colors() -> dict[str, str]:
    """A shade for each group, light to dark."""
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    shades = LinearSegmentedColormap.from_list("groups", _GROUPS)
    return {group: to_hex(shades(i / (len(GROUPS) - 1))) for i, group in enumerate(GROUPS)}


def _legend(figure: Figure, summary: Summary) -> None:
    """The groups' colours and totals, below the axes, where no bar is."""
    from matplotlib.patches import Patch

    colors = _group_colors()
    figure.legend(
        handles=[
            Patch(color=colors[group], label=f"{group} ({count:,})")
            for group, count in summary.groups.items()
        ],
        loc="outside lower center",
        ncols=len(summary.groups),
        frameon=False,
        fontsize=10,
        labelcolor=INK,
    )
