"""What all charts share: the page, bars, notes and axes."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, Literal

from er_gym.writing import write_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 100
INK, MUTED, GRID = "#222222", "#666666", "#e4e4e4"
HEAT = ("#f7f5fa", "#54278f")
"""From few to many."""


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


def write_chart(path: Path, figure: Figure, *, force: bool, **options: Any) -> None:
    """Write a chart as :func:`~er_gym.writing.write_figure` does, in :func:`own_style`."""
    with own_style():
        write_figure(path, figure, force=force, **options)


def canvas(width: float, height: float, heading: str) -> tuple[Figure, Axes]:
    """A figure of its own with a heading and one pair of axes; inches."""
    figure = new_figure(width, height)
    # Constrained layout leaves room for a title above the axes only if it is the figure's.
    lines = fill(heading, int(width * 9.5))
    figure.suptitle(lines, x=0.01, ha="left", fontsize=12, fontweight="bold", color=INK)
    axes = figure.add_subplot()
    axes.set_facecolor("white")
    axes.tick_params(length=0, pad=6, labelsize=10, labelcolor=INK)
    axes.set_axisbelow(True)
    for spine in axes.spines.values():
        spine.set_visible(False)
    return figure, axes


def bars(axes: Axes, names: Sequence[str], counts: Sequence[int], colors: Sequence[str]) -> None:
    """Horizontal bars, the first on top, each with its figure."""
    axes.barh(range(len(names)), counts, 0.75, color=colors)
    for place, count in enumerate(counts):
        note(axes, f"{count:,}", (count, place), (4, 0), ha="left", va="center_baseline")
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    count_axis(axes, "x")


def note(
    axes: Axes, text: str, at: tuple[float, float], shift: tuple[int, int], ha: str, va: str
) -> None:
    """A figure beside a point: at the data's place, shifted by points."""
    axes.annotate(
        text, at, shift, textcoords="offset points", ha=ha, va=va, fontsize=9.5, color=INK
    )


def count_axis(axes: Axes, which: Literal["x", "y"]) -> None:
    """Whole numbers and a light grid along an axis, with room for a figure past the longest bar."""
    from matplotlib.ticker import MaxNLocator, StrMethodFormatter

    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(MaxNLocator(8, integer=True))
    axis.set_major_formatter(StrMethodFormatter("{x:,.0f}"))
    axes.grid(axis=which, color=GRID, linewidth=0.8)
    axes.tick_params(axis=which, labelcolor=MUTED)
    _, high = axes.get_xlim() if which == "x" else axes.get_ylim()
    (axes.set_xlim if which == "x" else axes.set_ylim)(0, high * 1.05)
