"""Learning curves as pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from benchmarks.scoring.drawing import draw, write_charts
from benchmarks.scoring.series import Axis, Chart, Point, Series

_POINTS = 200


@dataclass(frozen=True)
class Curves:
    """What is drawn of a kind of runs.

    Attributes:
        name: with which the pictures' names begin.
        over: the values on the horizontal axes, one picture each: by what they are multiplied
            there, and the label.
        panels: the successes, one panel each, with its title.
    """

    name: str
    over: Mapping[str, tuple[float, str]]
    panels: Mapping[str, str]


POLICIES = Curves(
    "learning",
    {"steps": (1e-3, "thousand steps"), "seconds": (1 / 60, "minutes")},
    {
        "rollout/success_rate": "while it trains, training rooms",
        "eval/success_rate": "held out, unseen rooms",
    },
)
"""Of ``er-gym train-rl``."""
REINFORCED = Curves(
    "reinforcement",
    {"episodes": (1e-3, "thousand episodes"), "seconds": (1 / 60, "minutes")},
    {
        "success": "episodes that it learns from",
        "validation/success": "validation, the likeliest tokens",
    },
)
"""Of ``er-gym reinforce``."""


class HasCurve(Protocol):
    """A run with a learning curve."""

    @property
    def curve(self) -> list[dict[str, float]]:
        """Lines with what is drawn, and the values over which it is."""


def draw_curves(
    families: Mapping[str, Sequence[HasCurve]],
    out: Path,
    kind: Curves = POLICIES,
    *,
    force: bool = True,
) -> list[Path]:
    """Draw success over steps or episodes, and over minutes. Each family has a line: mean, minimum
    and maximum of its seeds.

    Returns:
        The files.

    Raises:
        ImportError: matplotlib is not installed.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    figures = {}
    for over, (scale, label) in kind.over.items():
        panels = [
            Chart(
                title,
                Axis(label),
                Axis("success, %", 0.0, 100.0),
                [Series(name, _mean(runs, key, over, scale)) for name, runs in families.items()],
            )
            for key, title in kind.panels.items()
        ]
        figures[f"{kind.name}_{over}"] = draw(*panels, width=11, height=4.2)
    return write_charts(out, figures, force=force)


def _mean(runs: Sequence[HasCurve], key: str, over: str, scale: float) -> list[Point]:
    """The mean of some curves, with the lowest and the highest, where all of them have values."""
    lines = []
    for run in runs:
        points = [(line[over] * scale, 100 * line[key]) for line in run.curve if key in line]
        if points:
            lines.append(np.array(points).T)
    if not lines:
        return []
    at = np.linspace(max(x[0] for x, _ in lines), min(x[-1] for x, _ in lines), _POINTS)
    values = np.array([np.interp(at, x, y) for x, y in lines])
    ends = values.mean(axis=0), values.min(axis=0), values.max(axis=0)
    return [Point(*map(float, point)) for point in zip(at, *ends, strict=True)]
