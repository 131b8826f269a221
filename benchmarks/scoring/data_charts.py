"""Statistics of a collection as charts, beside the paper's figures: PNG files."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.scoring.drawing import (
    DPI,
    HEAT,
    INK,
    MUTED,
    canvas,
    count_axis,
    note,
    own_style,
    write_chart,
)
from er_gym.data import paper_figures as paper
from er_gym.data.statistics import STATES, Statistics, mean_and_most
from er_gym.data.trajectory import THOUGHT_KINDS
from er_gym.writing import check_output, make_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OURS, _PAPER = "#2470ad", "#c9ccd1"
_PARTS = ("#0b3a6b", "#2470ad", "#5ba3d0", "#a9d0ea", "#dcebf5")
"""Shades of one hue, which every kind of eye tells apart."""


@own_style()
def draw_statistics(found: Statistics, out: Path, *, force: bool = True) -> list[Path]:
    """Draw the transitions, the kinds of thoughts, and the lengths of trajectories.

    Args:
        out: the folder to draw into; made where it is missing.
        force: whether to replace also files of the same names that er-gym did not write; without
            it, and where there is one, none is drawn.

    Returns:
        The files.

    Raises:
        ImportError: matplotlib is not installed.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    figures = {
        "transitions": _transitions(found),
        "kinds": _kinds(found),
        "actions": _actions(found),
    }
    make_folder(out)
    files = {out / f"{name}.png": figure for name, figure in figures.items()}
    for path in files:
        check_output(path, force=force)
    for path, figure in files.items():
        write_chart(path, figure, force=force, dpi=DPI, bbox_inches="tight", pad_inches=0.15)
    return list(files)


def _transitions(found: Statistics) -> Figure:
    """What follows what, and under each figure the paper's."""
    from matplotlib.colors import LinearSegmentedColormap

    shares, columns = found.transition_shares(), STATES[1:]
    table = [[shares.get(row, {}).get(column, 0.0) for column in columns] for row in STATES]
    heading = f"{found.name}: what follows what, % of the row; below, the paper's"
    figure, axes = canvas(9.6, 6.4, heading)
    heat = LinearSegmentedColormap.from_list("heat", HEAT)
    axes.pcolormesh(table, cmap=heat, vmin=0, vmax=100, edgecolors="white", linewidth=2)
    for y, row in enumerate(STATES):
        for x, column in enumerate(columns):
            ours, theirs = table[y][x], paper.TRANSITIONS[row].get(column, 0)
            faint = not (ours or theirs)
            colour = "white" if ours > 65 else MUTED if faint else INK
            axes.text(x + 0.5, y + 0.4, f"{ours:.0f}", ha="center", va="center", color=colour)
            if not faint:
                below = f"({theirs:.0f})"
                axes.text(
                    x + 0.5, y + 0.72, below, ha="center", va="center", color=colour, fontsize=8.5
                )
    axes.set_xticks([x + 0.5 for x in range(len(columns))], columns)
    axes.set_yticks([y + 0.5 for y in range(len(STATES))], STATES)
    axes.invert_yaxis()
    axes.xaxis.tick_top()
    axes.set_ylabel("after", color=MUTED, fontsize=10)
    return figure


def _kinds(found: Statistics) -> Figure:
    """Shares of the kinds of thoughts, each above the paper's."""
    of_paper = sum(paper.THOUGHTS.values())
    figure, axes = canvas(
        8.6, 4.6, f"{found.name}: thoughts by kind, in %, n = {found.all_thoughts:,}"
    )
    for place, kind in enumerate(THOUGHT_KINDS):
        ours = 100 * found.thoughts[kind] / max(found.all_thoughts, 1)
        theirs = 100 * paper.THOUGHTS[kind] / of_paper
        for share, shift, colour in ((ours, -0.2, _OURS), (theirs, 0.2, _PAPER)):
            axes.barh(place + shift, share, 0.38, color=colour)
            at = (share, place + shift)
            note(axes, f"{share:.1f}", at, (4, 0), ha="left", va="center_baseline")
    axes.set_yticks(range(len(THOUGHT_KINDS)), THOUGHT_KINDS)
    axes.set_ylim(len(THOUGHT_KINDS) - 0.4, -0.6)
    count_axis(axes, "x")
    _legend(figure, {"this collection": _OURS, "the paper": _PAPER})
    return figure


def _actions(found: Statistics) -> Figure:
    """How many trajectories have how many actions, by part."""
    every: Counter[int] = sum((part.actions for part in found.parts.values()), Counter())
    lengths = range(min(every), max(every) + 1)
    mean, _ = mean_and_most(every)
    width = min(max(7.6, 1.4 + 0.42 * len(lengths)), 16.0)
    heading = f"{found.name}: trajectories by number of actions, mean {mean:.2f}, n = "
    figure, axes = canvas(width, 4.8, f"{heading}{found.trajectories:,}")
    colours, below = {}, [0] * len(lengths)
    for place, (name, part) in enumerate(found.parts.items()):
        heights = [part.actions[number] for number in lengths]
        label = f"{name or 'no part'} (mean {mean_and_most(part.actions)[0]:.2f}{_told(name)})"
        colours[label] = colour = _PARTS[place % len(_PARTS)]
        axes.bar(lengths, heights, 0.8, below, color=colour, edgecolor="white", lw=0.6)
        below = [low + height for low, height in zip(below, heights, strict=True)]
    _whole_ticks(axes, lengths)
    axes.set_xlabel("actions, end included", color=MUTED, fontsize=10)
    count_axis(axes, "y")
    _legend(figure, colours)
    return figure


def _told(part: str) -> str:
    """The paper's mean for a part."""
    stage = paper.STAGE_OF_PART.get(part)
    one = next((each for each in paper.SETS if each.stage == stage), None)
    return "" if one is None else f", paper's set {stage}: {one.actions:.2f}"


def _whole_ticks(axes: Axes, lengths: range) -> None:
    step = max(1, round(len(lengths) / 24))
    axes.set_xticks(lengths[::step])
    axes.set_xlim(lengths[0] - 0.7, lengths[-1] + 0.7)


def _legend(figure: Figure, colours: dict[str, str]) -> None:
    """Below the axes, where no bar is."""
    from matplotlib.patches import Patch

    figure.legend(
        handles=[Patch(color=colour, label=label) for label, colour in colours.items()],
        loc="outside lower center",
        ncols=2,
        frameon=False,
        fontsize=10,
        labelcolor=INK,
    )
