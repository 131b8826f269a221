"""Learning curves as pictures, drawn with matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from benchmarks.scoring.drawing import new_figure, own_style, write_chart
from er_gym.writing import make_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLORS = ("#2470ad", "#b5762a", "#2a8c82", "#54278f", "#a33b4a", "#5b6b2f")
_INK, _MUTED, _GRID = "#222222", "#666666", "#e4e4e4"
_POINTS = 200
_PANELS = {
    "rollout/success_rate": "while it trains, training rooms",
    "eval/success_rate": "held out, unseen rooms",
}


class HasCurve(Protocol):
    """A run with a learning curve."""

    @property
    def curve(self) -> list[dict[str, float]]:
        """Lines with ``steps`` and the logged values."""


@own_style()
def draw_curves(
    families: Mapping[str, Sequence[HasCurve]], out: Path, *, force: bool = True
) -> list[Path]:
    """Draw success over steps and over minutes. Each family has a line: mean, minimum and maximum
    of its seeds.

    Returns:
        The files.

    Raises:
        ImportError: matplotlib is not installed.
    """
    make_folder(out)
    made = []
    for over, scale, label in (("steps", 1e-3, "thousand steps"), ("seconds", 1 / 60, "minutes")):
        figure = new_figure(11, 4.2)
        for axes, (key, title) in zip(
            figure.subplots(1, 2, sharey=True), _PANELS.items(), strict=True
        ):
            for color, (name, runs) in zip(_COLORS, families.items(), strict=False):
                _draw_family(axes, runs, key, over, scale, color, name)
            _style_axes(axes, title, label)
        figure.axes[0].set_ylabel("success, %", color=_MUTED)
        figure.axes[1].legend(frameon=False, labelcolor=_INK, loc="lower right")
        file = out / f"learning_{over}.png"
        write_chart(file, figure, force=force, dpi=100)
        made.append(file)
    return made


def _draw_family(
    axes: Axes,
    runs: Sequence[HasCurve],
    key: str,
    over: str,
    scale: float,
    color: str,
    name: str,
) -> None:
    lines = []
    for run in runs:
        points = [(line[over] * scale, 100 * line[key]) for line in run.curve if key in line]
        if points:
            lines.append(np.array(points).T)
    if not lines:
        return
    at = np.linspace(max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines), _POINTS)
    values = np.array([np.interp(at, x, y) for x, y in lines])
    axes.plot(at, values.mean(axis=0), color=color, label=name, linewidth=1.8)
    if len(lines) > 1:
        axes.fill_between(
            at, values.min(axis=0), values.max(axis=0), color=color, alpha=0.18, linewidth=0
        )


def _style_axes(axes: Axes, title: str, label: str) -> None:
    axes.set_title(title, loc="left", fontsize=11, color=_INK)
    axes.set_xlabel(label, color=_MUTED)
    axes.set_ylim(0, 100)
    axes.grid(color=_GRID, linewidth=0.8)
    axes.tick_params(length=0, labelcolor=_MUTED)
    for spine in axes.spines.values():
        spine.set_visible(False)
