"""The picture of a study: success over a number, such as that of the trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from benchmarks.ablation.result import RowResult
from benchmarks.ablation.settings import Study
from benchmarks.scoring.drawing import GRID, MUTED, canvas, note, own_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LINE, _SEED = "#2470ad", "#9fc0dd"


@own_style()
def draw_study(study: Study, results: Sequence[RowResult]) -> Figure:
    """Draw success in % over the study's numbers: a line with 95 % intervals, and a dot for each
    seed.

    Args:
        study: has a number for each row.
        results: of its rows; at least one.

    Raises:
        ImportError: matplotlib is not installed.
    """
    figure, axes = canvas(8.5, 4.6, study.title)
    number_of = dict(zip(study.rows, study.numbers, strict=True))
    places = [number_of[each.name] for each in results]
    for place, each in zip(places, results, strict=True):
        rates = [100 * rate for rate in each.by_seed.values()]
        axes.scatter([place] * len(rates), rates, s=18, color=_SEED, zorder=3)
    means = [each.summary["success"] for each in results]
    lengths = [
        [100 * (each.mean - (each.low or 0.0)) for each in means],
        [100 * ((each.high or 0.0) - each.mean) for each in means],
    ]
    values = [100 * each.mean for each in means]
    axes.errorbar(places, values, yerr=lengths, color=_LINE, marker="o", capsize=4, linewidth=2)
    for place, value in zip(places, values, strict=True):
        note(axes, f"{value:.0f}", (place, value), (7, 4), ha="left", va="bottom")
    axes.set_xscale("log", base=2)
    axes.set_xticks(places, [f"{place:g}" for place in places])
    axes.set_ylim(bottom=0)
    axes.set_xlabel(study.axis, color=MUTED)
    axes.set_ylabel("success, %", color=MUTED)
    axes.grid(axis="y", color=GRID, linewidth=0.8)
    return figure
