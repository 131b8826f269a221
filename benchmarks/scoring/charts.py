"""A suite's distributions as charts: PNG files, drawn with matplotlib."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Literal

from er_gym.tasks.difficulty import length
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.suite_card import Summary, summarise
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, GROUPS
from er_gym.writing import check_output, make_folder, write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_DPI = 100
_BAR = 0.27
"""Inches from one bar to the next, wide enough for a name beside each."""
_TOP = 40
"""The most bars in a chart of object types."""
_INK, _MUTED, _GRID = "#222222", "#666666", "#e4e4e4"

# Each chart keeps to one hue; steps differ in lightness, which every kind of eye tells apart.
_GROUPS = ("#a9d0ea", "#5ba3d0", "#2470ad", "#0b3a6b")
_OBJECTS, _RECEPTACLES = "#2a8c82", "#b5762a"
_HEAT = ("#f7f5fa", "#54278f")


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
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        raise ImportError("charts need matplotlib: pip install 'er-gym[charts]'") from error
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
        write_figure(path, figure, force=force, dpi=_DPI, bbox_inches="tight", pad_inches=0.15)
    return list(files)


def _types(summary: Summary, title: str) -> Figure:
    names = [BY_NAME[name].title for name in summary.types]
    colors = _group_colors()
    heading = f"{title}: tasks by type, n = {summary.tasks:,}"
    figure, axes = _canvas(9.6, 1.6 + _BAR * 1.2 * len(names), heading)
    _bars(
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
    figure, axes = _canvas(8.6, 1.3 + _BAR * 0.9 * max(len(shown), 3), heading)
    _bars(axes, list(shown), list(shown.values()), [color] * len(shown))
    return figure


def _lengths(tasks: Sequence[Task], summary: Summary, title: str) -> Figure:
    lengths = range(min(summary.lengths), max(summary.lengths) + 1)
    counts = Counter((task.type.group, length(task)) for task in tasks)
    width = min(max(7.6, 1.4 + 0.5 * len(lengths)), 16.0)
    heading = f"{title}: tasks by number of key actions, n = {summary.tasks:,}"
    figure, axes = _canvas(width, 4.8, heading)
    colors, below = _group_colors(), [0] * len(lengths)
    for group in summary.groups:
        heights = [counts[group, number] for number in lengths]
        axes.bar(lengths, heights, 0.8, below, color=colors[group], edgecolor="white", lw=0.6)
        below = [low + height for low, height in zip(below, heights, strict=True)]
    for number, total in zip(lengths, below, strict=True):
        if total:
            _note(axes, f"{total:,}", (number, total), (0, 3), ha="center", va="bottom")
    axes.set_xticks(lengths)
    axes.set_xlim(lengths[0] - 0.7, lengths[-1] + 0.7)
    axes.set_xlabel("key actions", color=_MUTED, fontsize=10)
    _count_axis(axes, "y")
    _legend(figure, summary)
    return figure


def _rooms(tasks: Sequence[Task], summary: Summary, title: str) -> Figure:
    from matplotlib.colors import LinearSegmentedColormap

    kinds, types = list(summary.room_kinds), list(summary.types)
    counts = Counter((task.type.name, room_kind(task.scene)) for task in tasks)
    table = [[counts[name, kind] for kind in kinds] for name in types]
    heading = f"{title}: tasks by type and kind of room, n = {summary.tasks:,}"
    figure, axes = _canvas(9.2, 1.6 + _BAR * 1.3 * len(types), heading)
    heat = LinearSegmentedColormap.from_list("heat", _HEAT)
    most = max(map(max, table))
    axes.pcolormesh(table, cmap=heat, vmin=0, vmax=most, edgecolors="white", linewidth=2)
    for row, line in enumerate(table):
        for column, count in enumerate(line):
            color = "white" if count > 0.55 * most else _INK if count else _MUTED
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


def _canvas(width: float, height: float, heading: str) -> tuple[Figure, Axes]:
    """A figure of its own, with one pair of axes; inches. Nothing of pyplot's state is used."""
    from matplotlib.figure import Figure

    figure = Figure((width, height), facecolor="white", layout="constrained")
    # Constrained layout leaves room for a title above the axes only if it is the figure's.
    lines = fill(heading, int(width * 9.5))
    figure.suptitle(lines, x=0.01, ha="left", fontsize=12, fontweight="bold", color=_INK)
    axes = figure.add_subplot()
    axes.set_facecolor("white")
    axes.tick_params(length=0, pad=6, labelsize=10, labelcolor=_INK)
    axes.set_axisbelow(True)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return figure, axes


def _bars(axes: Axes, names: Sequence[str], counts: Sequence[int], colors: Sequence[str]) -> None:
    """Horizontal bars, the first on top, each with its figure."""
    axes.barh(range(len(names)), counts, 0.75, color=colors)
    for place, count in enumerate(counts):
        _note(axes, f"{count:,}", (count, place), (4, 0), ha="left", va="center_baseline")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    _count_axis(axes, "x")


def _note(
    axes: Axes, text: str, at: tuple[float, float], shift: tuple[int, int], ha: str, va: str
) -> None:
    axes.annotate(
        text, at, shift, textcoords="offset points", ha=ha, va=va, fontsize=9.5, color=_INK
    )


def _count_axis(axes: Axes, which: Literal["x", "y"]) -> None:
    """Whole numbers and a light grid along an axis, with room for a figure past the longest bar."""
    from matplotlib.ticker import MaxNLocator, StrMethodFormatter

    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(MaxNLocator(8, integer=True))
    axis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.grid(axis=which, color=_GRID, linewidth=0.8)
    axes.tick_params(axis=which, labelcolor=_MUTED)
    _, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    (axes.set_xlim if which == "x" else axes.set_ylim)(0, high * 1.05)


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
        labelcolor=_INK,
    )
