"""A room from above as SVG: floor, furniture, what matters to the task, and the agent's way."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence

from markupsafe import Markup

from benchmarks.monitor.world import GRID, Footprint, Stand, World

_SCALE = 60.0
"""Units of the drawing for a metre."""
_MARGIN = 0.4
_SIGHT = 1.5
"""How far the view cone is drawn, metres: as far as the agent reaches."""
_LETTER = 7.6
"""About how wide a letter is."""
_LARGE = 0.25
"""Furniture with a larger area is named, square metres."""
_SMALLEST = 0.12
"""The least side at which an object is drawn, metres."""


def room_map(world: World, wanted: Collection[str], label: str) -> Markup:
    """The map. Its elements name their step in ``data-map-step``; those of what is hidden at first
    have the class ``hidden-thing``.

    Args:
        world: the room.
        wanted: the ids of the objects of the key actions, which are marked and named.
        label: says what the picture is, for readers who do not see it.
    """
    boxes = [(x, z, GRID, GRID) for x, z in world.floor.tolist()]
    boxes += [(each.x, each.z, each.width, each.depth) for each in world.objects if each.holds]
    west = min(x - w / 2 for x, _, w, _ in boxes) - _MARGIN
    east = max(x + w / 2 for x, _, w, _ in boxes) + _MARGIN
    south = min(z - d / 2 for _, z, _, d in boxes) - _MARGIN
    north = max(z + d / 2 for _, z, _, d in boxes) + _MARGIN
    draw = _Draw(west, north, east - west)
    marked = draw.all_wanted([each for each in world.objects if each.object_id in wanted])
    furniture = sorted((each for each in world.objects if each.holds), key=_area, reverse=True)
    body = Markup("").join(
        (
            *(draw.box("floor", x, z, GRID, GRID) for x, z in world.floor.tolist()),
            *(draw.thing(each) for each in furniture),
            *(draw.name(each) for each in furniture if each.object_id not in wanted),
            draw.way(world.stands),
            *marked,
            *(draw.hidden(each) for each in world.objects
              if each.inside and each.object_id not in wanted),
            *draw.stands(world.stands, world.field_of_view),
        )
    )  # fmt: skip
    return Markup(
        '<svg class="room" viewBox="0 0 {:.0f} {:.0f}" role="img" aria-label="{}">{}</svg>'
    ).format(_SCALE * (east - west), _SCALE * (north - south), label, body)


def _area(one: Footprint) -> float:
    return one.width * one.depth


def _sides(one: Footprint) -> tuple[float, float]:
    return max(one.width, _SMALLEST), max(one.depth, _SMALLEST)


class _Draw:
    """Turns the world's metres, x east and z north, into the drawing's units.

    Args:
        west, north: the drawing's left and upper edge; ``width``: how far it reaches from west to
            east. No words cross its edges.
    """

    def __init__(self, west: float, north: float, width: float) -> None:
        self._west, self._north, self._width = west, north, _SCALE * width
        self._words: list[tuple[float, float, float, float]] = []

    def free(self, left: float, middle: float, words: str) -> bool:
        """Whether words fit at a height without touching others; if so the room is taken."""
        right, top, bottom = left + _LETTER * len(words), middle - 8, middle + 8
        if any(left < r and a < right and top < b and t < bottom for a, t, r, b in self._words):
            return False
        self._words.append((left, top, right, bottom))
        return True

    def begin(self, x: float, gap: float, words: str) -> float:
        """Where words begin that stand beside a point: to its right, else to its left."""
        length = _LETTER * len(words)
        right = x + gap + length > self._width
        return max(0.0, x - gap - length) if right else x + gap

    def at(self, x: float, z: float) -> tuple[float, float]:
        return _SCALE * (x - self._west), _SCALE * (self._north - z)

    def box(self, kind: str, x: float, z: float, width: float, depth: float) -> Markup:
        left, top = self.at(x - width / 2, z + depth / 2)
        return Markup(
            '<rect class="{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>'
        ).format(kind, left, top, _SCALE * width, _SCALE * depth)

    def thing(self, one: Footprint) -> Markup:
        shown = self.box("thing", one.x, one.z, *_sides(one))
        return Markup("<g><title>{}</title>{}</g>").format(one.object_type, shown)

    def name(self, one: Footprint) -> Markup:
        """The name of large furniture, where there is room for it."""
        width, depth = _sides(one)
        x, y = self.at(one.x, one.z)
        length = _LETTER * len(one.object_type)
        left = max(0.0, min(x - length / 2, self._width - length))
        if width * depth < _LARGE or not self.free(left, y, one.object_type):
            return Markup("")
        return Markup('<text class="name" x="{:.1f}" y="{:.1f}">{}</text>').format(
            left + length / 2, y, one.object_type
        )

    def all_wanted(self, things: Sequence[Footprint]) -> list[Markup]:
        """The marked objects; the names of those in one place stand one below the other."""
        drawn = []
        for one in things:
            x, down = self.at(one.x, one.z)
            while not self.free(self.begin(x, 12, one.object_type), down, one.object_type):
                down += 4
            drawn.append(self.wanted(one, down))
        return drawn

    def wanted(self, one: Footprint, down: float) -> Markup:
        """A marked object, its name at a height of its own."""
        x, y = self.at(one.x, one.z)
        return Markup(
            '<g class="wanted"><title>{}</title><circle cx="{:.1f}" cy="{:.1f}" r="9"/>'
            '<text x="{:.1f}" y="{:.1f}">{}</text></g>'
        ).format(one.object_id, x, y, self.begin(x, 12, one.object_type), down + 5, one.object_type)

    def hidden(self, one: Footprint) -> Markup:
        x, y = self.at(one.x, one.z)
        return Markup(
            '<g class="hidden-thing"><title>{} – {}</title>'
            '<rect x="{:.1f}" y="{:.1f}" width="8" height="8"/>'
            '<text x="{:.1f}" y="{:.1f}">{}</text></g>'
        ).format(
            one.object_type, one.inside, x - 4, y - 4,
            self.begin(x, 7, one.object_type), y + 4, one.object_type,
        )  # fmt: skip

    def way(self, stands: Collection[Stand]) -> Markup:
        """The whole way, and a line for the part of it that lies behind the agent."""
        points = " ".join("{:.1f},{:.1f}".format(*self.at(each.x, each.z)) for each in stands)
        return Markup(
            '<polyline class="way to-come" points="{}"/><polyline class="way past" points=""/>'
        ).format(points)

    def stands(self, stands: Collection[Stand], angle: float) -> Iterator[Markup]:
        """The agent with its view cone at every step."""
        for number, each in enumerate(stands):
            x, y = self.at(each.x, each.z)
            edges = []
            for side in (-angle / 2, angle / 2):
                turn = math.radians(each.rotation + side)
                edges.append(
                    self.at(each.x + _SIGHT * math.sin(turn), each.z + _SIGHT * math.cos(turn))
                )
            yield Markup(
                '<g class="stand" data-map-step="{}"><path class="cone" d="M{:.1f} {:.1f}L{:.1f} '
                '{:.1f}A{:.0f} {:.0f} 0 0 1 {:.1f} {:.1f}Z"/><circle class="agent" cx="{:.1f}" '
                'cy="{:.1f}" r="8"/></g>'
            ).format(number, x, y, *edges[0], _SCALE * _SIGHT, _SCALE * _SIGHT, *edges[1], x, y)
