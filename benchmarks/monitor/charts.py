"""Charts of series as SVG: lines, points with intervals, bars. No script and no library draws them.

Series differ in colour and in dash and marker, so that no eye and no printer depends on colours.
The classes ``s0`` to ``s7`` get their colours from ``static/charts.css``, for light and dark.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from benchmarks.scoring.series import Axis, Chart, Point, Series, decimated

_WIDTH, _HEIGHT = 480, 280
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 14, 12, 44
_LEGEND_LINE, _LETTER = 17, 7.6
"""The height of a line of the legend and the width of a letter in it, units of the drawing."""
_STYLES = 8
_GREY = 6
"""The style of bars, which are behind what matters."""
_ALL_MARKED = 60
"""A series of so many points has a marker at each, a longer one at some."""
_SOME_MARKED = 7
_DOTS = 5_000
"""From so many in thousands."""


def as_svg(name: str, chart: Chart) -> Markup:
    """A chart as SVG; empty if no series has a point.

    Args:
        name: unique in its page; the chart's title and description have ids made from it.
        chart: what it shows.
    """
    x, y, series = chart.x, chart.y, chart.series
    shown = [
        (
            _GREY if each.kind == "bars" and len(series) > 1 else number % _STYLES,
            each,
            _fitting(each.points, x, y),
        )
        for number, each in enumerate(series)
    ]
    shown = [one for one in shown if one[2]]
    if not shown:
        return Markup("")
    every = [point for _, _, found in shown for point in found]
    bars = any(each.kind == "bars" for _, each, _ in shown)
    across = _Scale.over([*(point.x for point in every), *x.at], x, 0.5 if x.names else 0.0, 0.0)
    reached = [end for point in every for end in (point.low, point.high)]
    up = _Scale.over(reached + [0.0] * bars, y, 0.0, 0.04)
    rows = _legend_rows([each.name for _, each, _ in shown])
    top = _TOP + _LEGEND_LINE * len(rows) * (len(shown) > 1)
    draw = _Draw(across, up, top, _HEIGHT + top, len(shown))
    described = "; ".join(_described(each.name, found) for _, each, found in shown)
    behind_first = sorted(shown, key=lambda one: one[1].kind != "bars")
    body = Markup("").join(
        (
            *(draw.legend(rows, shown) if len(shown) > 1 else ()),
            *draw.axes(x, y),
            *(draw.series(number, each, found) for number, each, found in behind_first),
        )
    )
    return Markup(
        '<svg class="chart" viewBox="0 0 {} {}" role="img" aria-labelledby="{}-title {}-desc">'
        '<title id="{}-title">{}</title><desc id="{}-desc">{}</desc>{}</svg>'
    ).format(_WIDTH, _HEIGHT + top, name, name, name, chart.title, name, described, body)


def round_ticks(low: float, high: float, about: int = 5) -> list[float]:
    """Round numbers from ``low`` to ``high``: steps of 1, 2 or 5 times a power of ten."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * each for each in (1, 2, 5, 10) if power * each >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [number * step for number in range(first, last + 1)]


def tick_label(value: float, ticks: Sequence[float]) -> str:
    """How a tick is written, given all ticks: ``0.25``, ``40``, ``120k``, ``1.5M``, ``2e-5``."""
    if value == 0:
        return "0"
    largest = max(map(abs, ticks))
    if largest < 1e-3 or largest >= 1e12:
        return f"{value:.3g}".replace("e-0", "e-").replace("e+", "e")
    unit, sign = (1e6, "M") if largest >= 2e6 else (1e3, "k") if largest > _DOTS else (1.0, "")
    return f"{float(f'{value / unit:.6g}'):.10g}{sign}"


@dataclass(frozen=True)
class _Scale:
    low: float
    high: float
    log: bool

    @staticmethod
    def over(values: Sequence[float], axis: Axis, margin: float, pad: float) -> _Scale:
        """The scale of an axis, from the data where the axis leaves it open.

        Args:
            values: of the data.
            axis: which.
            margin: added at both ends, for names.
            pad: added to an end that the data decide, as a share of the whole.
        """
        low, high = min(values), max(values)
        if axis.names:
            low, high = 0.0, float(len(axis.names) - 1)
        if axis.log:
            logs = math.log10(low), math.log10(high)
            more = max(pad, 0.04) * max(logs[1] - logs[0], 0.5)
            return _Scale(logs[0] - more, logs[1] + more, True)
        open_low, open_high = axis.low is None, axis.high is None
        low = low if axis.low is None else axis.low
        high = high if axis.high is None else axis.high
        if not high > low:
            low, high = low - (abs(low) or 1.0) * 0.1 * open_low, high + (abs(high) or 1.0) * 0.1
        more = pad * (high - low)
        low -= margin + (more if open_low and low < 0 else 0.0)
        return _Scale(low, high + margin + (more if open_high else 0.0), False)

    def __call__(self, value: float) -> float:
        """Where a value is, from 0 to 1."""
        return ((math.log10(value) if self.log else value) - self.low) / (self.high - self.low)

    def ticks(self, about: int) -> list[float]:
        if not self.log:
            return round_ticks(self.low, self.high, about)
        powers = range(math.floor(self.low), math.ceil(self.high) + 1)
        factors = (1, 2, 5) if self.high - self.low < 2.6 else (1,)
        every = [factor * 10.0**power for power in powers for factor in factors]
        return [each for each in every if self.low <= math.log10(each) <= self.high]


def _fitting(found: Sequence[Point], x: Axis, y: Axis) -> list[Point]:
    """The points that can be drawn."""
    return decimated(
        [
            point
            for point in found
            if all(map(math.isfinite, point))
            and not (y.log and point.low <= 0)
            and not (x.log and point.x <= 0)
        ]
    )


def _described(name: str, found: Sequence[Point]) -> str:
    ys = [point.y for point in found]
    return f"{name}: {len(ys)}, {min(ys):.4g} … {max(ys):.4g}, → {ys[-1]:.4g}"


def _legend_rows(names: Sequence[str]) -> list[list[int]]:
    """The numbers of the names in each line of the legend."""
    rows: list[list[int]] = [[]]
    used = 0.0
    for number, name in enumerate(names):
        wide = _legend_width(name)
        if rows[-1] and used + wide > _WIDTH - _LEFT:
            rows.append([])
            used = 0.0
        rows[-1].append(number)
        used += wide
    return rows


def _legend_width(name: str) -> float:
    return 36 + sum(_LETTER * (1.8 if ord(letter) > 0x2E7F else 1) for letter in name)


@dataclass(frozen=True)
class _Draw:
    """Turns values into the drawing's units; ``lines`` is how many series there are."""

    across: _Scale
    up: _Scale
    top: float
    height: float
    lines: int

    def at(self, x: float, y: float) -> tuple[float, float]:
        return (
            _LEFT + self.across(x) * (_WIDTH - _LEFT - _RIGHT),
            self.height - _BOTTOM - self.up(y) * (self.height - _BOTTOM - self.top),
        )

    def legend(
        self, rows: Sequence[Sequence[int]], shown: Sequence[tuple[int, Series, Sequence[Point]]]
    ) -> Iterator[Markup]:
        for line, row in enumerate(rows):
            left, y = float(_LEFT), _TOP + _LEGEND_LINE * line
            for number in row:
                style, each, _ = shown[number]
                yield Markup('<g class="s{} key">').format(style)
                if each.kind == "bars":
                    box = Markup('<rect class="bar" x="{:.1f}" y="{}" width="22" height="9"/>')
                    yield box.format(left, y - 5)
                else:
                    if each.kind == "line":
                        yield Markup('<path class="line" d="M{:.1f} {}h22"/>').format(left, y)
                    yield _marker(style, left + 11, y)
                yield Markup('<text x="{:.1f}" y="{}">{}</text></g>').format(
                    left + 27, y + 4, each.name
                )
                left += _legend_width(each.name)

    def axes(self, x: Axis, y: Axis) -> Iterator[Markup]:
        left, right, bottom = _LEFT, _WIDTH - _RIGHT, self.height - _BOTTOM
        for value, label in _labelled(y, self.up, 5):
            _, down = self.at(self._any_x, value)
            yield Markup(
                '<path class="grid" d="M{} {:.1f}H{}"/>'
                '<text class="tick y" x="{}" y="{:.1f}">{}</text>'
            ).format(left, down, right, left - 6, down + 4, label)
        for value, label in _labelled(x, self.across, 6):
            at, _ = self.at(value, self._any_y)
            yield Markup(
                '<path class="mark" d="M{:.1f} {}v4"/>'
                '<text class="tick x" x="{:.1f}" y="{}">{}</text>'
            ).format(at, bottom, at, bottom + 17, label)
        yield Markup('<path class="base" d="M{} {}H{}"/>').format(left, bottom, right)
        yield Markup('<text class="label x" x="{}" y="{}">{}</text>').format(
            (left + right) / 2, self.height - 8, x.label
        )
        upright = '<text class="label y" transform="translate(13 {:.0f}) rotate(-90)">{}</text>'
        yield Markup(upright).format((self.top + bottom) / 2, y.label)

    @property
    def _any_x(self) -> float:
        return 10.0**self.across.low if self.across.log else self.across.low

    @property
    def _any_y(self) -> float:
        return 10.0**self.up.low if self.up.log else self.up.low

    def series(self, style: int, each: Series, found: Sequence[Point]) -> Markup:
        body = Markup("").join(self._parts(style, each, found))
        return Markup('<g class="s{}">{}</g>').format(style, body)

    def _parts(self, style: int, each: Series, found: Sequence[Point]) -> Iterator[Markup]:
        if each.kind == "bars":
            wide = 0.5 * (_WIDTH - _LEFT - _RIGHT) / (self.across.high - self.across.low)
            for point in found:
                (x, y), (_, zero) = self.at(point.x, point.y), self.at(point.x, 0.0)
                yield Markup(
                    '<rect class="bar" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}">'
                    "<title>{}: {:.4g}</title></rect>"
                ).format(x - wide / 2, y, wide, max(0.0, zero - y), each.name, point.y)
                if each.named:
                    yield self._value(x - wide / 2 + 3, y - 4, point.y)
            return
        ranged = any(point.low < point.high for point in found)
        if ranged and not each.whiskers and len(found) > 1:
            edge = [self.at(point.x, point.high) for point in found]
            edge += [self.at(point.x, point.low) for point in reversed(found)]
            yield Markup('<polygon class="band" points="{}"/>').format(_path(edge))
        places = [self.at(point.x, point.y) for point in found]
        if each.kind == "line" and len(found) > 1:
            yield Markup('<polyline class="line" points="{}"/>').format(_path(places))
        if ranged and each.whiskers:
            for point, (x, _) in zip(found, places, strict=True):
                low, high = self.at(point.x, point.low)[1], self.at(point.x, point.high)[1]
                yield Markup(
                    '<path class="whisker" d="M{:.1f} {:.1f}V{:.1f}M{:.1f} {:.1f}h8M{:.1f} '
                    '{:.1f}h8"/>'
                ).format(x, low, high, x - 4, low, x - 4, high)
        for number in _marked(len(found), each.kind, self.lines):
            point, (x, y) = found[number], places[number]
            yield Markup("<g><title>{}: {:.6g}, {:.4g}</title>{}</g>").format(
                each.name, point.x, point.y, _marker(style, x, y)
            )
            if each.named:
                yield self._value(x + 6, y + (13 if style % 2 else -6), point.y)

    def _value(self, x: float, y: float, value: float) -> Markup:
        written = f"{value:.0f}" if abs(value) >= 10 else f"{value:.2g}"
        return Markup('<text class="value" x="{:.1f}" y="{:.1f}">{}</text>').format(x, y, written)


def _labelled(axis: Axis, scale: _Scale, about: int) -> list[tuple[float, str]]:
    if axis.names:
        return list(enumerate(axis.names))
    if axis.at:
        return [(value, f"{value:.10g}") for value in axis.at]
    ticks = scale.ticks(about)
    return [(value, tick_label(value, [value] if scale.log else ticks)) for value in ticks]


def _marked(n: int, kind: str, lines: int) -> list[int]:
    """The numbers of the points that have a marker. A long line by itself needs none."""
    if n <= _ALL_MARKED or kind == "points":
        return list(range(n))
    if lines == 1:
        return []
    return [int((number + 0.5) * n / _SOME_MARKED) for number in range(_SOME_MARKED)]


def _path(places: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in places)


_MARKERS = (
    "M-3.2 0a3.2 3.2 0 1 0 6.4 0a3.2 3.2 0 1 0-6.4 0Z",
    "M-3-3H3V3H-3Z",
    "M0-4L4 0L0 4L-4 0Z",
    "M0-4L3.8 3H-3.8Z",
    "M0 4L3.8-3H-3.8Z",
    "M-4-1.2H-1.2V-4H1.2V-1.2H4V1.2H1.2V4H-1.2V1.2H-4Z",
    "M-3.4 3.4L3.4-3.4M-3.4-3.4L3.4 3.4",
    "M-4 0H4M0-4V4",
)
"""The shapes of the markers, one for each style."""


def _marker(style: int, x: float, y: float) -> Markup:
    return Markup('<path class="marker" transform="translate({:.1f} {:.1f})" d="{}"/>').format(
        x, y, _MARKERS[style]
    )
