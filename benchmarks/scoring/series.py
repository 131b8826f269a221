"""What a chart shows: series over two axes. It is described once and drawn in two ways: as a
picture by :mod:`benchmarks.scoring.drawing`, and in a page by :mod:`benchmarks.monitor.charts`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from benchmarks.scoring.metrics import Estimate

MOST_POINTS = 500
"""A series is drawn with no more points; neighbours are drawn as their mean, with their range."""


class Point(NamedTuple):
    """A point of a series, and the interval or the range around it; equal to ``y`` for none."""

    x: float
    y: float
    low: float
    high: float


@dataclass(frozen=True)
class Series:
    """A series.

    Attributes:
        name: in the legend.
        points: in order.
        kind: how it is drawn.
        whiskers: whether the intervals are lines at the points rather than a band behind them.
        named: whether each value stands beside its point.
    """

    name: str
    points: Sequence[Point]
    kind: Literal["line", "points", "bars"] = "line"
    whiskers: bool = False
    named: bool = False


@dataclass(frozen=True)
class Axis:
    """An axis.

    Attributes:
        label: beside it.
        low, high: its ends; None for the data's.
        log: whether it is logarithmic. Points at 0 and below are then left out.
        names: of the places 0, 1, 2 …, for an axis without numbers.
        at: the places of the ticks; none for round ones.
    """

    label: str = ""
    low: float | None = None
    high: float | None = None
    log: bool = False
    names: Sequence[str] = ()
    at: Sequence[float] = ()


@dataclass(frozen=True)
class Chart:
    """A chart.

    Attributes:
        title: above a picture; in a page, for readers who do not see it.
        x, y: the axes.
        series: at most eight, which look different.
    """

    title: str
    x: Axis
    y: Axis
    series: Sequence[Series]


def points(pairs: Sequence[tuple[float, float]]) -> list[Point]:
    """Points without an interval."""
    return [Point(x, y, y, y) for x, y in pairs]


def percentages(rates: Sequence[tuple[float, Estimate | None]]) -> list[Point]:
    """Rates in % with their intervals, each at its place; None for one that is not known yet."""
    return [
        Point(float(x), 100 * rate.mean, 100 * rate.low, 100 * rate.high)
        for x, rate in rates
        if rate is not None and rate.low is not None and rate.high is not None
    ]


def decimated(found: Sequence[Point], most: int = MOST_POINTS) -> list[Point]:
    """At most so many points: neighbours become their mean, with the range of all of them."""
    if len(found) <= most:
        return list(found)
    size = -(-len(found) // most)
    return [_mean(found[begin : begin + size]) for begin in range(0, len(found), size)]


def _mean(found: Sequence[Point]) -> Point:
    n = len(found)
    return Point(
        sum(point.x for point in found) / n,
        sum(point.y for point in found) / n,
        min(point.low for point in found),
        max(point.high for point in found),
    )
