"""Typical failures of a run: for each kind one episode, on a map of its room."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median_low
from textwrap import fill
from typing import TYPE_CHECKING, Literal, TypeAlias

from benchmarks.monitor.failures import FAILURES, Failure, failure_of
from benchmarks.monitor.world import GRID, Footprint, World, Worlds
from benchmarks.scoring.drawing import GRID as FAINT
from benchmarks.scoring.drawing import INK, MUTED, new_figure, own_style
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FLOOR, _THING, _WAY, _WANTED = "#efefec", "#d8d5e6", "#2470ad", "#a33b4a"
Side: TypeAlias = Literal["left", "center"]
_COLUMNS = 3
_PANEL = 4.0
"""The side of a map, inches."""
_NAMED = 0.4
"""Furniture with a larger area is named, square metres."""


@dataclass(frozen=True)
class Example:
    """An episode that stands for a kind of failures.

    Attributes:
        kind: why it failed.
        share: of all episodes that failed so, a fraction.
        record: the episode.
    """

    kind: Failure
    share: float
    record: EpisodeRecord


def failure_shares(records: Sequence[EpisodeRecord]) -> dict[Failure, float]:
    """The share of all episodes that failed for each reason, in the order of ``FAILURES``."""
    counts = Counter(map(failure_of, records))
    return {kind: counts[kind] / len(records) for kind in FAILURES if counts[kind]}


def examples(records: Sequence[EpisodeRecord]) -> list[Example]:
    """An episode of each kind of failures but crashes, of median length; most frequent first."""
    by_kind: dict[Failure, list[EpisodeRecord]] = {}
    for record in sorted(records, key=lambda each: each.key):
        kind = failure_of(record)
        if kind is not None and kind != "crashed":
            by_kind.setdefault(kind, []).append(record)
    found = []
    for kind, failed in sorted(by_kind.items(), key=lambda pair: -len(pair[1])):
        length = median_low([len(each.steps) for each in failed])
        chosen = next(each for each in failed if len(each.steps) == length)
        found.append(Example(kind, len(failed) / len(records), chosen))
    return found


@own_style()
def draw_examples(manifest: Manifest, found: Sequence[Example]) -> Figure:
    """A map for each example: the floor, the furniture, what the task is about, and the way.

    Args:
        manifest: of the run that they are of; its suite must be one of er-gym's own.
        found: the examples, at least one.

    Raises:
        CannotReplay: an episode cannot be played again.
        ImportError: matplotlib is not installed.
    """
    lines = -(-len(found) // _COLUMNS)
    figure = new_figure(_PANEL * _COLUMNS, (_PANEL + 0.3) * lines)
    panels = figure.subplots(lines, _COLUMNS, squeeze=False).flat
    worlds = Worlds()
    for axes, example in zip(panels, found, strict=False):
        _draw(axes, worlds.world(manifest, example.record), example)
    for axes in panels[len(found) :]:
        axes.set_axis_off()
    return figure


def _draw(axes: Axes, world: World, example: Example) -> None:
    from matplotlib.patches import Rectangle

    def box(x: float, z: float, width: float, depth: float, colour: str) -> None:
        corner = (x - width / 2, z - depth / 2)
        axes.add_patch(Rectangle(corner, width, depth, facecolor=colour, edgecolor="none"))

    furniture = sorted((each for each in world.objects if each.holds), key=_area, reverse=True)
    for one in furniture:
        box(one.x, one.z, one.width, one.depth, _THING)
    # Above the furniture, whose boxes also cover the inner corners of counters.
    for x, z in world.floor.tolist():
        box(x, z, GRID, GRID, _FLOOR)
    axes.set_aspect("equal")
    axes.autoscale_view()
    words = _Words(axes)
    wanted = {key.object_id for key in example.record.key_actions if key.object_id}
    sought = example.record.search_targets or ()
    for one in world.objects:
        if one.object_id in wanted or one.object_type in sought:
            axes.plot(one.x, one.z, "o", markersize=9, markeredgewidth=1.6, color="none",
                      markeredgecolor=_WANTED)  # fmt: skip
            words.beside(one.x, one.z, one.object_type, 7.5, _WANTED)
    axes.plot([each.x for each in world.stands], [each.z for each in world.stands],
              color=_WAY, linewidth=1.2, alpha=0.7)  # fmt: skip
    for (x, z), numbers in _stops(world):
        label = ",".join(map(str, numbers[:3])) + ("…" if len(numbers) > 3 else "")
        axes.plot(x, z, "o", markersize=4, color=_WAY)
        words.beside(x, z, label, 7, _WAY)
    for one in furniture:
        if _area(one) > _NAMED and one.object_id not in wanted:
            words.over(one.x, one.z, one.object_type, 6.5, MUTED)
    title = f"{example.kind}: {100 * example.share:.1f} % of the episodes"
    axes.set_title(title, loc="left", fontsize=10, fontweight="bold", color=INK)
    axes.set_xlabel(fill(example.record.instruction, 52), fontsize=8.5, color=INK)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_color(FAINT)


def _area(one: Footprint) -> float:
    return one.width * one.depth


class _Words:
    """Writes names on a map, none over another."""

    def __init__(self, axes: Axes) -> None:
        (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
        self._axes = axes
        self._metres = max(east - west, north - south) / (72 * _PANEL)
        """For a point of the page."""
        self._taken: list[tuple[float, float, float, float]] = []

    def beside(self, x: float, z: float, words: str, size: float, colour: str) -> None:
        """To the right of a place, lower where there is no room."""
        x += 7 * self._metres
        while not self._free(x, z, words, size):
            z -= 2 * self._metres
        self._write(x, z, words, size, colour, "left")

    def over(self, x: float, z: float, words: str, size: float, colour: str) -> None:
        """Over a place, if there is room."""
        if self._free(x - self._width(words, size) / 2, z, words, size):
            self._write(x, z, words, size, colour, "center")

    def _write(self, x: float, z: float, words: str, size: float, colour: str, side: Side) -> None:
        self._axes.text(x, z, words, fontsize=size, color=colour, ha=side, va="center")

    def _width(self, words: str, size: float) -> float:
        return 0.62 * size * len(words) * self._metres

    def _free(self, left: float, z: float, words: str, size: float) -> bool:
        """Whether words touch no others; then they take the room."""
        right, half = left + self._width(words, size), 0.6 * size * self._metres
        low, high = z - half, z + half
        if any(left < r and w < right and low < h and b < high for w, b, r, h in self._taken):
            return False
        self._taken.append((left, low, right, high))
        return True


def _stops(world: World) -> Iterable[tuple[tuple[float, float], list[int]]]:
    """The places where the agent stood, with the numbers of the steps after which it stood there
    first: not those of the steps in between."""
    found: dict[tuple[float, float], list[int]] = {}
    last = None
    for number, stand in enumerate(world.stands):
        at = stand.x, stand.z
        if at != last:
            found.setdefault(at, []).append(number)
        last = at
    return found.items()


def in_words(example: Example, most: int = 16) -> str:
    """What the agent did, in a line, such as ``1 navigate Fridge, 2 open Fridge``."""
    steps = [
        " ".join(filter(None, (str(number), step.verb, step.object_type)))
        + ("" if step.success else " (failed)")
        for number, step in enumerate(example.record.steps)
        if number and not step.appended
    ]
    return ", ".join(steps[:most]) + (" …" if len(steps) > most else "")
