"""What follows what, as a picture: bands from state to state, as wide as they are frequent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

_WIDTH, _HEIGHT, _GAP, _NODE = 620, 380, 13, 11
_LEFT, _RIGHT, _TOP = 138, 138, 26
_THINNEST = 0.4
"""A band that would be thinner than this is not drawn."""


@dataclass(frozen=True)
class _Node:
    name: str
    top: float
    height: float


def flow(
    name: str,
    title: str,
    counts: Mapping[str, Mapping[str, int]],
    words: Mapping[str, str],
    heads: tuple[str, str],
) -> Markup:
    """A picture of transitions; empty if there are none.

    Args:
        name: unique in its page.
        title: for readers who do not see it.
        counts: by state, then by the state that followed, how often. A state's class is its name.
        words: what the picture calls each state, in the order from top to bottom.
        heads: above both sides.
    """
    total = sum(sum(row.values()) for row in counts.values())
    if not total:
        return Markup("")
    before = [state for state in words if sum(counts.get(state, {}).values())]
    after = [state for state in words if any(row.get(state) for row in counts.values())]
    room = _HEIGHT - _TOP - 8
    scale = (room - _GAP * (max(len(before), len(after)) - 1)) / total
    left = _stacked(before, [sum(counts[state].values()) for state in before], scale, room)
    right = _stacked(
        after, [sum(row.get(state, 0) for row in counts.values()) for state in after], scale, room
    )
    parts = [Markup('<text class="head" x="{}" y="12" text-anchor="end">{}</text>').format(
        _LEFT + _NODE, heads[0]), Markup('<text class="head" x="{}" y="12">{}</text>').format(
        _WIDTH - _RIGHT - _NODE, heads[1])]  # fmt: skip
    ends = {node.name: node.top for node in right}
    for node in left:
        begin, row = node.top, counts[node.name]
        whole = sum(row.values())
        for state in after:
            count = row.get(state, 0)
            wide = count * scale
            if count and wide >= _THINNEST:
                told = (
                    f"{words[node.name]} → {words[state]}: {count:,} ({100 * count / whole:.0f} %)"
                )
                parts.append(_band(node.name, begin, ends[state], wide, told))
            begin += wide
            ends[state] += wide
    parts += [_bar(node, words[node.name], _LEFT, "end") for node in left]
    parts += [_bar(node, words[node.name], _WIDTH - _RIGHT - _NODE, "start") for node in right]
    described = "; ".join(
        f"{words[a]} → {words[b]} {100 * n / sum(row.values()):.0f} %"
        for a, row in counts.items()
        if a in words
        for b, n in row.items()
        if n and b in words
    )
    return Markup(
        '<svg class="flow" viewBox="0 0 {} {}" role="img" aria-labelledby="{}-title {}-desc">'
        '<title id="{}-title">{}</title><desc id="{}-desc">{}</desc>{}</svg>'
    ).format(_WIDTH, _HEIGHT, name, name, name, title, name, described, Markup("").join(parts))


def _stacked(names: Sequence[str], counts: Sequence[int], scale: float, room: float) -> list[_Node]:
    """Nodes below one another, in the middle of the height."""
    used = sum(counts) * scale + _GAP * (len(names) - 1)
    top, nodes = _TOP + (room - used) / 2, []
    for name, count in zip(names, counts, strict=True):
        nodes.append(_Node(name, top, count * scale))
        top += count * scale + _GAP
    return nodes


def _band(kind: str, begin: float, end: float, wide: float, told: str) -> Markup:
    x1, x2 = _LEFT + _NODE, _WIDTH - _RIGHT - _NODE
    middle = (x1 + x2) / 2
    a, b = begin + wide / 2, end + wide / 2
    return Markup(
        '<path class="band k-{}" stroke-width="{:.1f}" d="M{} {:.1f}C{:.1f} {:.1f} {:.1f} {:.1f} '
        '{} {:.1f}"><title>{}</title></path>'
    ).format(kind, wide, x1, a, middle, a, middle, b, x2, b, told)


def _bar(node: _Node, word: str, x: float, anchor: str) -> Markup:
    return Markup(
        '<rect class="node k-{}" x="{}" y="{:.1f}" width="{}" height="{:.1f}"/>'
        '<text x="{}" y="{:.1f}" text-anchor="{}">{}</text>'
    ).format(
        node.name,
        x,
        node.top,
        _NODE,
        max(node.height, 1.5),
        x - 7 if anchor == "end" else x + _NODE + 7,
        node.top + node.height / 2 + 4,
        anchor,
        word,
    )
