"""Draws all charts that are pictures: the page, bars, heat maps, and series over axes.

Series are told by :mod:`benchmarks.scoring.series`, as those of the monitor's pages are.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal

from benchmarks.scoring.series import Axis, Chart, Series
from er_gym.writing import check_output, make_folder, write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED, GRID = "#222222", "#666666", "#e4e4e4"
OURS, PAPER = "#2470ad", "#c9c9d2"
"""Of figures of er-gym, and of the paper's beside them."""
_COLOURS = (OURS, "#b5762a", "#2a8c82", "#54278f", "#a33b4a", "#5b6b2f", "#5d646e", "#c04f00")
_HEAT = ("#f7f5fa", "#54278f")
"""From few to many."""
_DARK = 0.6
"""From this share of the most on, a heat map's cell is so dark that its figure is white."""
_MOST_TICKS = 24


@contextlib.contextmanager
def own_style() -> Iterator[None]:
    """Draw with matplotlib's own defaults; the settings of other code are as before afterwards.

    A chart opens no window, so ``MPLBACKEND`` is not for it: matplotlib refuses to be imported
    where that names a backend that this Python lacks, as a notebook leaves it for its commands. The
    user's ``matplotlibrc`` is not for it either: fonts, LaTeX and colours would change a chart.

    Raises:
        ImportError: matplotlib is not installed; the message says how to install it.
    """
    wanted = os.environ.pop("MPLBACKEND", None)
    try:
        import matplotlib.figure
    except ImportError as error:
        raise ImportError("charts need matplotlib: pip install 'er-gym[charts]'") from error
    finally:
        if wanted is not None:
            os.environ["MPLBACKEND"] = wanted
    defaults = matplotlib.rcParamsDefault
    with matplotlib.rc_context({name: defaults[name] for name in defaults if name != "backend"}):
        yield


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of its own, inches. Nothing of pyplot's state is used."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure((width, height), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    return figure


@own_style()
def write_charts(out: Path, figures: Mapping[str, Figure], *, force: bool) -> list[Path]:
    """Write charts into a folder, all of them or none.

    Args:
        out: the folder; made where it is missing.
        figures: by the names of their files, without ``.png``.
        force: whether to replace also files of the same names that er-gym did not write.

    Returns:
        The files, in order.

    Raises:
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    make_folder(out)
    files = {out / f"{name}.png": figure for name, figure in figures.items()}
    for path in files:
        check_output(path, force=force)
    for path, figure in files.items():
        # "tight" grows the page to whatever sticks out of it: no label is cut.
        write_figure(path, figure, force=force, dpi=100, bbox_inches="tight", pad_inches=0.15)
    return list(files)


def canvas(width: float, height: float, heading: str) -> tuple[Figure, Axes]:
    """A figure of its own with a heading and one pair of axes; inches."""
    figure = new_figure(width, height)
    # Constrained layout leaves room for a title above the axes only if it is the figure's.
    lines = fill(heading, int(width * 9.5))
    figure.suptitle(lines, x=0.01, ha="left", fontsize=12, fontweight="bold", color=INK)
    axes = figure.add_subplot()
    axes.set_axisbelow(True)
    _bare(axes, INK)
    return figure, axes


def _bare(axes: Axes, colour: str) -> None:
    """No frame and no ticks, only their labels."""
    axes.tick_params(length=0, pad=6, labelsize=10, labelcolor=colour)
    for spine in axes.spines.values():
        spine.set_visible(False)


@own_style()
def draw(*charts: Chart, width: float = 8.5, height: float = 4.6) -> Figure:
    """Draw a chart, or several of the same series side by side, with one y axis; inches.

    Raises:
        ImportError: matplotlib is not installed.
    """
    if len(charts) == 1:
        figure, only = canvas(width, height, charts[0].title)
        panels = [only]
    else:
        figure = new_figure(width, height)
        panels = list(figure.subplots(1, len(charts), sharey=True))
    for axes, chart in zip(panels, charts, strict=True):
        if len(charts) > 1:
            _bare(axes, MUTED)
            axes.set_title(chart.title, loc="left", fontsize=11, color=INK)
        _draw_series(axes, chart)
        axes.label_outer()
    if len(charts[0].series) > 1:
        panels[-1].legend(frameon=False, labelcolor=INK)
    return figure


def _draw_series(axes: Axes, chart: Chart) -> None:
    for number, each in enumerate(chart.series):
        if each.points and each.kind == "bars":
            colour = PAPER if len(chart.series) > 1 else OURS
            axes.bar(
                [point.x for point in each.points],
                [point.y for point in each.points],
                0.6,
                color=colour,
                label=each.name,
            )
        elif each.points:
            _draw_line(axes, each, _COLOURS[number % len(_COLOURS)])
        for point in each.points if each.named else ():
            if each.kind == "bars":
                at = (point.x + 0.3, point.y)
                note(axes, f"{point.y:.0f}", at, (-3, 3), ha="right", va="bottom")
            else:
                at = (point.x, point.y)
                note(axes, f"{point.y:.0f}", at, (7, 4), ha="left", va="bottom")
    _draw_axis(axes, "x", chart.x)
    _draw_axis(axes, "y", chart.y)
    plain = bool(chart.x.names or chart.x.at)
    axes.grid(axis="y" if plain else "both", color=GRID, linewidth=0.8)


def _draw_line(axes: Axes, series: Series, colour: str) -> None:
    """A line or points, and their intervals: whiskers, or a band behind them."""
    xs, ys = [point.x for point in series.points], [point.y for point in series.points]
    lows, highs = [point.low for point in series.points], [point.high for point in series.points]
    ranged = lows != highs
    axes.errorbar(
        xs,
        ys,
        yerr=[
            [y - low for y, low in zip(ys, lows, strict=True)],
            [high - y for y, high in zip(ys, highs, strict=True)],
        ]
        if series.whiskers and ranged
        else None,
        color=colour,
        marker="o" if series.whiskers or series.kind == "points" else "",
        markersize=6 if series.whiskers else 4,
        capsize=4,
        linewidth=1.8,
        linestyle="-" if series.kind == "line" else "none",
        label=series.name,
    )
    if ranged and not series.whiskers:
        axes.fill_between(xs, lows, highs, color=colour, alpha=0.18, linewidth=0)


def _draw_axis(axes: Axes, which: Literal["x", "y"], axis: Axis) -> None:
    drawn = axes.xaxis if which == "x" else axes.yaxis
    if axis.log:
        (axes.set_xscale if which == "x" else axes.set_yscale)("log", base=2 if axis.at else 10)
    if axis.names:
        drawn.set_ticks(range(len(axis.names)), list(axis.names))
    elif axis.at:
        drawn.set_ticks(axis.at, [f"{value:g}" for value in axis.at])
    if not (axis.low is None and axis.high is None):
        (axes.set_xlim if which == "x" else axes.set_ylim)(axis.low, axis.high)
    drawn.set_label_text(axis.label, color=MUTED)


def bars(
    axes: Axes,
    names: Sequence[str],
    sets: Sequence[tuple[Sequence[float], str | Sequence[str]]],
    form: str,
) -> None:
    """Horizontal bars, the first on top, each with its figure.

    Args:
        axes: to draw on.
        names: beside the bars.
        sets: lengths of a bar for each name, and their colour or colours; of several sets, the
            first is above the others.
        form: how a figure is written, such as ``,``.
    """
    step = 0.8 / len(sets)
    for number, (lengths, colours) in enumerate(sets):
        shift = (number - (len(sets) - 1) / 2) * step
        places = [place + shift for place in range(len(names))]
        axes.barh(places, lengths, step - 0.03, color=colours)
        for place, length in zip(places, lengths, strict=True):
            told = f"{length:{form}}"
            note(axes, told, (length, place), (4, 0), ha="left", va="center_baseline")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    _count_axis(axes, "x")


def stacks(
    heading: str,
    label: str,
    numbers: range,
    parts: Sequence[tuple[str, str, Sequence[int]]],
    *,
    totals: bool,
) -> Figure:
    """How often each number occurs: a stack of bars for each.

    Args:
        heading: above the chart.
        label: what the numbers are of.
        numbers: the places of the stacks.
        parts: name, colour and counts of each part of the stacks, from the lowest.
        totals: whether each stack has its height above it.
    """
    figure, axes = canvas(min(max(7.6, 1.4 + 0.5 * len(numbers)), 16.0), 4.8, heading)
    below = [0] * len(numbers)
    for _, colour, heights in parts:
        axes.bar(numbers, heights, 0.8, below, color=colour, edgecolor="white", lw=0.6)
        below = [low + height for low, height in zip(below, heights, strict=True)]
    for number, total in zip(numbers, below, strict=True):
        if total and totals:
            note(axes, f"{total:,}", (number, total), (0, 3), ha="center", va="bottom")
    axes.set_xticks(numbers[:: max(1, round(len(numbers) / _MOST_TICKS))])
    axes.set_xlim(numbers[0] - 0.7, numbers[-1] + 0.7)
    axes.set_xlabel(label, color=MUTED, fontsize=10)
    _count_axis(axes, "y")
    legend_below(figure, {name: colour for name, colour, _ in parts})
    return figure


def heat(
    axes: Axes,
    values: Sequence[Sequence[float]],
    rows: Sequence[str],
    columns: Sequence[str],
    below: Sequence[Sequence[float]] | None = None,
    most: float | None = None,
) -> None:
    """A table of figures, darker where they are greater.

    Args:
        axes: to draw on.
        values: a row of them for each of ``rows``, a column for each of ``columns``.
        rows, columns: what stands beside and above.
        below: figures to compare with, in brackets below the others; a cell without either has
            none.
        most: the figure of the darkest cell; None for the greatest one.
    """
    from matplotlib.colors import LinearSegmentedColormap

    shades = LinearSegmentedColormap.from_list("heat", _HEAT)
    most = max(map(max, values)) if most is None else most
    axes.pcolormesh(values, cmap=shades, vmin=0, vmax=most, edgecolors="white", linewidth=2)
    for y, row in enumerate(values):
        for x, value in enumerate(row):
            other = below[y][x] if below else 0
            colour = "white" if value > _DARK * most else INK if value or other else MUTED
            style: dict[str, Any] = {"ha": "center", "va": "center", "color": colour}
            axes.text(x + 0.5, y + (0.4 if below else 0.5), f"{value:,.0f}", **style)
            if below and (value or other):
                axes.text(x + 0.5, y + 0.72, f"({other:,.0f})", fontsize=8.5, **style)
    axes.set_xticks([x + 0.5 for x in range(len(columns))], columns)
    axes.set_yticks([y + 0.5 for y in range(len(rows))], rows)
    axes.invert_yaxis()
    axes.xaxis.tick_top()


def shades(colours: Sequence[str], number: int) -> list[str]:
    """Some shades from the first to the last of some colours."""
    from matplotlib.colors import LinearSegmentedColormap, to_hex

    drawn = LinearSegmentedColormap.from_list("shades", list(colours))
    return [to_hex(drawn(place / max(1, number - 1))) for place in range(number)]


def legend_below(figure: Figure, colours: Mapping[str, str]) -> None:
    """A legend below the axes, where no bar is."""
    from matplotlib.patches import Patch

    short = sum(map(len, colours)) < 70
    figure.legend(
        handles=[Patch(color=colour, label=label) for label, colour in colours.items()],
        loc="outside lower center",
        ncols=len(colours) if short else 2,
        frameon=False,
        fontsize=10,
        labelcolor=INK,
    )


def note(
    axes: Axes, text: str, at: tuple[float, float], shift: tuple[int, int], ha: str, va: str
) -> None:
    """A figure beside a point: at the data's place, shifted by points."""
    axes.annotate(
        text, at, shift, textcoords="offset points", ha=ha, va=va, fontsize=9.5, color=INK
    )


def _count_axis(axes: Axes, which: Literal["x", "y"]) -> None:
    """Whole numbers and a light grid along an axis, with room for a figure past the longest bar."""
    from matplotlib.ticker import MaxNLocator, StrMethodFormatter

    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(MaxNLocator(8, integer=True))
    axis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.grid(axis=which, color=GRID, linewidth=0.8)
    axes.tick_params(axis=which, labelcolor=MUTED)
    _, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    (axes.set_xlim if which == "x" else axes.set_ylim)(0, high * 1.05)
