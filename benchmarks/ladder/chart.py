"""The picture of a ladder: success after each stage, beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from benchmarks.ladder.paper_rungs import PAPER
from benchmarks.ladder.result import RungResult
from benchmarks.ladder.settings import CONTROLS
from benchmarks.scoring.drawing import GRID, INK, MUTED, canvas, note, own_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_OURS, _FAULTS, _PAPER = "#2470ad", "#b5762a", "#c9c9d2"


@own_style()
def draw_ladder(results: Sequence[RungResult], heading: str) -> Figure:
    """Draw success in % over the rungs: bars for the paper's, a line with 95 % intervals for ours,
    and one for each rate of faults.

    Args:
        results: of the rungs, in order; at least one.
        heading: above the picture.

    Raises:
        ImportError: matplotlib is not installed.
    """
    figure, axes = canvas(8.5, 4.6, heading)
    names = list(dict.fromkeys(each.rung.name for each in results))
    place = {name: number for number, name in enumerate(names)}
    paper = [(place[name], PAPER[name]) for name in names if name in PAPER]
    axes.bar(
        [x for x, _ in paper],
        [model.success for _, model in paper],
        0.6,
        color=_PAPER,
        label="the paper's models, 809 tasks",
    )
    for x, model in paper:
        at = (x + 0.3, model.success)
        note(axes, f"{model.success:.0f}", at, (-3, 3), ha="right", va="bottom")
    ladder = [each for each in results if each.rung.name not in CONTROLS]
    lines = [
        (
            [each for each in ladder if each.rung.faults == rate],
            f"this ladder, {100 * rate:g} % of actions fail" if rate else "this ladder",
            _FAULTS if rate else _OURS,
            "-",
        )
        for rate in dict.fromkeys(each.rung.faults for each in ladder)
    ]
    if len(ladder) < len(results):
        controls = [each for each in results if each.rung.name in CONTROLS]
        lines.append((controls, "played beside it", MUTED, "none"))
    for line, label, colour, style in lines:
        rates = [each.summary["success"] for each in line]
        lengths = [
            [100 * (each.mean - (each.low or 0.0)) for each in rates],
            [100 * ((each.high or 0.0) - each.mean) for each in rates],
        ]
        axes.errorbar(
            [place[each.rung.name] for each in line],
            [100 * each.mean for each in rates],
            yerr=lengths,
            color=colour,
            marker="o",
            capsize=4,
            linewidth=2,
            linestyle=style,
            label=label,
        )
        for each, mean in zip(line, rates, strict=True):
            point = (place[each.rung.name], 100 * mean.mean)
            note(axes, f"{100 * mean.mean:.0f}", point, (7, 4), ha="left", va="bottom")
    axes.set_xticks(range(len(names)), names)
    axes.set_ylim(0, 100)
    axes.set_ylabel("success, %", color=MUTED)
    axes.grid(axis="y", color=GRID, linewidth=0.8)
    axes.legend(frameon=False, labelcolor=INK, loc="upper left")
    return figure
