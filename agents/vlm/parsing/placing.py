"""Reads decisions to put what is held somewhere: "put the Apple in my hand into the Fridge".

The receptacle is what counts. Places are looked for up to the first word that begins an explanation
or an opposite ("instead of"). :func:`_chosen` says which of several places is the receptacle; the
others say where the thing is now, or where the receptacle is. A place behind "into" or "onto" is
the receptacle, known or not.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from agents.vlm.parsing.names import clean_name, look_up
from agents.vlm.parsing.vocabulary import EDGES, VERBS
from er_gym.thor import OBJECT_TYPES

_BEFORE, _AFTER = r"(?<![^\W_])", r"(?![^\W_])"  # a word ends, or an underscore
_PUT = re.compile(
    r"(?:put|place|set|lay|drop|insert|store|throw|toss|deposit|stow)(?:[\s_]?object)?"
    rf"(?:\s(?:in|down|back|away))?{_AFTER}",
    re.IGNORECASE,
)
_MOVE = re.compile(rf"(?:move|return|bring|transfer|(?P<fetch>take|get)){_AFTER}", re.IGNORECASE)
"""Verbs that put only where they say what and where. ``fetch``: "take the Mug in the Sink" picks it
up, "take the Mug to the Sink" does not."""
_NOT = r"(?:instead\sof|rather\sthan|not)(?=\s(?:in|on|inside|into|onto|to)\s)"
_OPPOSITE = re.compile(rf"{_BEFORE}{_NOT}", re.IGNORECASE)
_STEP = re.compile(
    rf"{_BEFORE}(?P<place>(?:into|onto|in|on)\s?/\s?(?:in|on|onto|into)|in\sto|into|inside\sof|inside|in|"
    rf"onto|on\stop\sof|on\sto|on|atop|within|(?<!next\s)(?<!close\s)to){_AFTER}"
    rf"|{_BEFORE}(?P<stop>because|since|so|as|which|that|who|where|if|while|and|then|before|after|"
    rf"(?:instead\sof|rather\sthan)(?!\s(?:in|on|inside|into|onto|to)\s))"
    rf"{_AFTER}|{_BEFORE}(?P<opposite>{_NOT})|[,;，；。]|\.\s",
    re.IGNORECASE,
)
_MOTION = re.compile(r"into|onto|(?:in|on)\sto|to|.+/.+", re.IGNORECASE)
"""Prepositions that say where to, and never where something is."""
_INSIDE = frozenset({"inside", "inside of", "within"})
_PRONOUN = re.compile(
    r"(?:it|them|this|that|(?:(?:the|my)\s)?(?:held\s)?(?:object|item|thing))"
    r"(?:\s(?:back|down|away))?",
    re.IGNORECASE,
)
_PARTS = frozenset({"Drawer", "Shelf", "Cabinet"})
_FURNITURE = frozenset(
    {"CoffeeTable", "CounterTop", "Desk", "DiningTable", "Dresser", "ShelvingUnit", "SideTable",
     "TVStand"}
)  # fmt: skip
"""What has parts, and is not itself what something is "in"."""
_BETWEEN = re.compile(r"[\s,\[\]()]+")
_HANDS = frozenset({"hand", "hands", "gripper", "arm", "inventory", "possession"})
_CHINESE = (
    re.compile(r"[把将](?P<what>.+?)放(?:进|入|到|在|置在|置到|回)去?(?P<name>.+)"),
    re.compile(r"放(?P<what>[^进入到在置回下]+)(?:进|入|到|在)去?(?P<name>.+)"),
)


def receptacle_in(line: str) -> tuple[str, str, tuple[str, ...]] | None:
    """The receptacle of a line that says to put something.

    Args:
        line: with single spaces.

    Returns:
        What is put, as written and "" if it is not said, the receptacle's name, and the rules that
        the name needed; None if the line does not say both that and where.
    """
    spaced = line.replace("_", " ")  # of the same length, so that names can be had as written
    for pattern in _CHINESE:
        if found := pattern.match(spaced):
            name, rules = clean_name(line[slice(*found.span("name"))])
            return found["what"], name, rules
    if begun := _PUT.match(spaced):
        at = begun.end()
        if begun[0].casefold().endswith(" in"):
            at -= len(" in")
        placed = _behind_preposition(line, spaced, at) or _two_names(line, at)
        # "not in the Fridge" says no place, and what is put is none.
        return placed or ((line[at:], "", ()) if _OPPOSITE.search(spaced, at) else None)
    moved = _MOVE.match(spaced)
    if moved is None:
        return None
    placed = _behind_preposition(
        line, spaced, moved.end(), only_known=True, only_motion=bool(moved["fetch"])
    )
    return placed if placed and _known(placed[0]) else None


def _known(name: str) -> bool:
    return look_up(clean_name(name)[0]) is not None


@dataclass(frozen=True)
class _Place:
    """A preposition and the name behind it; ``types`` is empty for an unknown name."""

    start: int
    preposition: str
    name: str
    rules: tuple[str, ...]
    types: tuple[str, ...]

    @property
    def motion(self) -> bool:
        return _MOTION.fullmatch(self.preposition) is not None

    @property
    def carried(self) -> bool:
        """Whether it may itself stand in or on something."""
        movable = {"pickupable", "moveable"}
        return any(movable & {*OBJECT_TYPES[each].properties} for each in self.types)

    def is_part_of(self, other: _Place) -> bool:
        """``in the Drawer in the Desk``"""
        part, whole = _PARTS.issuperset(self.types), _FURNITURE.issuperset(other.types)
        return part and whole and other.preposition in {"in", *_INSIDE}


def _behind_preposition(
    line: str, spaced: str, start: int, *, only_known: bool = False, only_motion: bool = False
) -> tuple[str, str, tuple[str, ...]] | None:
    places = _places(line, spaced, start)
    motions = [each for each in places if each.motion]
    places = motions[:1] or ([] if only_motion else places)
    known = [each for each in places if each.types]
    if not known and not only_known:
        known = places[:1]
    if not known:
        return None
    taken = _chosen(known, line[start : places[0].start].strip(EDGES))
    return line[start : taken.start].strip(EDGES), taken.name, taken.rules


def _places(line: str, spaced: str, start: int) -> list[_Place]:
    """The places of a line, without hands, and without those of an explanation."""
    places: list[_Place] = []
    opposite = False
    for step in _STEP.finditer(spaced, start):
        if step["place"] is None:
            opposite = step["opposite"] is not None
            if any(each.types or each.motion for each in places):
                break
            continue
        preposition = " ".join(step["place"].casefold().split())
        name, rules = clean_name(line[step.end() :])
        entry = look_up(name)
        if opposite or name.casefold() in _HANDS:
            opposite = False
        elif preposition != "to" or (entry and name.casefold().split()[0] not in VERBS):
            places.append(
                _Place(step.start(), preposition, name, rules, entry.types if entry else ())
            )
        elif places:  # a purpose: "to cut bread on the plate"
            break
    return places


def _chosen(known: Sequence[_Place], what: str) -> _Place:
    """The receptacle among places behind "in" and "on"."""
    first, *others = known
    if others and (
        _PRONOUN.fullmatch(what)  # a place behind "it" does not say which thing is meant
        or first.is_part_of(others[0])
        or (first.preposition in _INSIDE and first.carried)
    ):
        return first
    return known[-1]


def _two_names(line: str, start: int) -> tuple[str, str, tuple[str, ...]] | None:
    """``put Apple Fridge``: two names of types side by side."""
    words = [word for word in _BETWEEN.split(line[start:]) if word]
    if look_up(" ".join(words)):
        return None
    for place in range(1, min(len(words), _MOST_WORDS)):
        what, name = " ".join(words[:place]), " ".join(words[place:])
        if look_up(what) and look_up(name):
            return what, name, ()
    return None


_MOST_WORDS = 8
"""The most words of what is put, and where, without a preposition."""
