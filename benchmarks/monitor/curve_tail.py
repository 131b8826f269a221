"""Follows a log of figures, one JSON object a line, while it grows.

However long the log is, of each figure no more than :data:`~benchmarks.scoring.series.MOST_POINTS`
points are kept: neighbours become their mean, with the range of all of them.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from benchmarks.monitor.line_tail import LineFollower, Lines
from benchmarks.scoring.series import MOST_POINTS, Point

_JSON: TypeAdapter[Any] = TypeAdapter(Any)
_MOST_NAMES = 100
"""No more figures are followed."""
_LAST_BYTES = 2**16


@dataclass
class Thinned:
    """A series of any length in few points.

    Attributes:
        stride: how many values are one point.
    """

    stride: int = 1
    _points: list[tuple[int, float, float, float, float]] = field(default_factory=list)
    """Number of values, sum of x, sum of y, least and greatest y."""

    def add(self, xs: Sequence[float], ys: Sequence[float]) -> None:
        """Add values in order."""
        begin = 0
        while begin < len(xs):
            if not self._points or self._points[-1][0] == self.stride:
                if len(self._points) == MOST_POINTS:
                    self._halve()
                    continue
                self._points.append((0, 0.0, 0.0, math.inf, -math.inf))
            n, sum_x, sum_y, low, high = self._points[-1]
            end = min(len(xs), begin + self.stride - n)
            some = ys[begin:end]
            self._points[-1] = (
                n + end - begin,
                sum_x + sum(xs[begin:end]),
                sum_y + sum(some),
                min(low, *some),
                max(high, *some),
            )
            begin = end

    def _halve(self) -> None:
        pairs = zip(self._points[::2], self._points[1::2], strict=True)
        self._points = [
            (a[0] + b[0], a[1] + b[1], a[2] + b[2], min(a[3], b[3]), max(a[4], b[4]))
            for a, b in pairs
        ]
        self.stride *= 2

    def points(self) -> list[Point]:
        """The points: mean of x, mean of y, least and greatest y."""
        return [Point(x / n, y / n, low, high) for n, x, y, low, high in self._points]


@dataclass
class CurveTail(LineFollower):
    """The series of a log.

    Attributes:
        over: the name of the figure that is the others' x.
        series: by name, in the order in which they came.
        last: of each figure the last value.
        lines: how many were read.
    """

    longest = 2**20

    over: str = "steps"
    series: dict[str, Thinned] = field(default_factory=dict)
    last: dict[str, float] = field(default_factory=dict)
    lines: int = 0

    def points(self, name: str, scale: float = 1.0) -> list[Point]:
        """The points of a figure, its values multiplied; none if it never came."""
        found = self.series[name].points() if name in self.series else []
        return [Point(x, y * scale, low * scale, high * scale) for x, y, low, high in found]

    def _forget(self) -> None:
        self.series, self.last, self.lines = {}, {}, 0

    def _take(self, lines: Lines) -> None:
        found = _parsed(lines.lines)
        all_xs: list[Any] = [each.get(self.over) for each in found]
        if not _all_numbers(all_xs):
            found = [each for each in found if _is_number(each.get(self.over))]
            all_xs = [each[self.over] for each in found]
        self.lines += len(found)
        for name in dict.fromkeys(name for each in found for name in each):
            if name not in self.series:
                if len(self.series) >= _MOST_NAMES:
                    continue
                self.series[name] = Thinned()
            xs = all_xs
            ys: list[Any] = [each.get(name) for each in found]
            if not _all_numbers(ys):
                told = [pair for pair in zip(xs, ys, strict=True) if _is_number(pair[1])]
                xs, ys = [x for x, _ in told], [y for _, y in told]
            if ys:
                self.series[name].add(xs, ys)
                self.last[name] = ys[-1]


def last_line(file: Path) -> dict[str, Any]:
    """The last whole line of a log, without reading the rest; empty if there is none."""
    try:
        with file.open("rb") as log:
            log.seek(max(0, log.seek(0, os.SEEK_END) - _LAST_BYTES))
            lines = log.read().split(b"\n")[:-1]
    except OSError:
        return {}
    for line in reversed(lines):
        if found := _parsed([line]):
            return found[0]
    return {}


def _parsed(lines: Sequence[bytes]) -> list[dict[str, Any]]:
    """The objects among some lines; a half-written line is skipped."""
    try:
        found = _JSON.validate_json(b"[" + b",".join(filter(None, lines)) + b"]")
    except ValueError:
        found = []
        for line in lines:
            try:
                found.append(_JSON.validate_json(line))
            except ValueError:
                continue
    return [each for each in found if isinstance(each, dict)]


def _all_numbers(values: Sequence[Any]) -> bool:
    """Whether all are finite numbers. Nearly always they are, and a sum is quickly made."""
    try:
        return set(map(type, values)) <= {int, float} and math.isfinite(sum(values))
    except OverflowError:  # a whole number that no float can hold
        return False


def _is_number(value: Any) -> bool:
    return _all_numbers([value])
