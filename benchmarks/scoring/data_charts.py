"""Statistics of a collection as charts, beside the paper's figures: PNG files."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.scoring.drawing import (
    MUTED,
    OURS,
    PAPER,
    bars,
    canvas,
    heat,
    legend_below,
    own_style,
    stacks,
    write_charts,
)
from er_gym.data import paper_figures as paper
from er_gym.data.statistics import STATES, Statistics, mean_and_most
from er_gym.data.trajectory import THOUGHT_KINDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    return write_charts(out, figures, force=force)


def _transitions(found: Statistics) -> Figure:
    """What follows what, and under each figure the paper's."""
    shares, columns = found.transition_shares(), STATES[1:]
    heading = f"{found.name}: what follows what, % of the row; below, the paper's"
    figure, axes = canvas(9.6, 6.4, heading)
    heat(
        axes,
        [[shares.get(row, {}).get(column, 0.0) for column in columns] for row in STATES],
        STATES,
        columns,
        below=[[paper.TRANSITIONS[row].get(column, 0) for column in columns] for row in STATES],
        most=100,
    )
    axes.set_ylabel("after", color=MUTED, fontsize=10)
    return figure


def _kinds(found: Statistics) -> Figure:
    """Shares of the kinds of thoughts, each above the paper's."""
    heading = f"{found.name}: thoughts by kind, in %, n = {found.all_thoughts:,}"
    figure, axes = canvas(8.6, 4.6, heading)
    of_paper, every = sum(paper.THOUGHTS.values()), max(found.all_thoughts, 1)
    ours = [100 * found.thoughts[kind] / every for kind in THOUGHT_KINDS]
    theirs = [100 * paper.THOUGHTS[kind] / of_paper for kind in THOUGHT_KINDS]
    bars(axes, THOUGHT_KINDS, [(ours, OURS), (theirs, PAPER)], ".1f")
    legend_below(figure, {"this collection": OURS, "the paper": PAPER})
    return figure


def _actions(found: Statistics) -> Figure:
    """How many trajectories have how many actions, by part."""
    every: Counter[int] = sum((part.actions for part in found.parts.values()), Counter())
    lengths = range(min(every), max(every) + 1)
    mean, _ = mean_and_most(every)
    return stacks(
        f"{found.name}: trajectories by number of actions, mean {mean:.2f}, n = "
        f"{found.trajectories:,}",
        "actions, end included",
        lengths,
        [
            (
                f"{name or 'no part'} (mean {mean_and_most(part.actions)[0]:.2f}{_told(name)})",
                _PARTS[place % len(_PARTS)],
                [part.actions[number] for number in lengths],
            )
            for place, (name, part) in enumerate(found.parts.items())
        ],
        totals=False,
    )


def _told(part: str) -> str:
    """The paper's mean for a part."""
    stage = paper.STAGE_OF_PART.get(part)
    one = next((each for each in paper.SETS if each.stage == stage), None)
    return "" if one is None else f", paper's set {stage}: {one.actions:.2f}"
