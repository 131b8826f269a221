"""Reads decisions to put what is held somewhere: "put the Apple in my hand into the Fridge".

The receptacle is what counts. It stands behind the last preposition that is followed by the name of
a type, up to the first word that begins an explanation; without any, behind the first preposition.
"""

from __future__ import annotations

import re

from agents.vlm.names import look_up
from agents.vlm.parsing.names import clean_name
from agents.vlm.parsing.vocabulary import EDGES

_BEFORE, _AFTER = r"(?<![^\W_])", r"(?![^\W_])"  # a word ends, or an underscore
_PUT = re.compile(
    r"(?:put|place|set|lay|drop|insert|store|throw|toss|deposit|stow)(?:[\s_]?object)?"
    rf"(?:\s(?:in|down|back|away))?{_AFTER}",
    re.IGNORECASE,
)
_MOVE = re.compile(rf"(?:move|return|bring|transfer|take){_AFTER}", re.IGNORECASE)
"""Verbs that put only where they say what and where."""
_STEP = re.compile(
    rf"{_BEFORE}(?P<place>(?:in|on)\s?/\s?(?:in|on|onto|into)|in\sto|into|inside\sof|inside|in|"
    rf"onto|on\stop\sof|on\sto|on|atop|within|(?<!next\s)(?<!close\s)to){_AFTER}"
    rf"|{_BEFORE}(?P<stop>because|since|so|as|which|that|who|where|if|while|and|then|before|after)"
    rf"{_AFTER}|[,;，；。]|\.\s",
    re.IGNORECASE,
)
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
        return _behind_preposition(line, spaced, at) or _two_names(line, at)
    moved = _MOVE.match(spaced)
    placed = _behind_preposition(line, spaced, moved.end(), only_known=True) if moved else None
    return placed if placed and _known(placed[0]) else None


def _known(name: str) -> bool:
    return look_up(clean_name(name)[0]) is not None


def _behind_preposition(
    line: str, spaced: str, start: int, *, only_known: bool = False
) -> tuple[str, str, tuple[str, ...]] | None:
    chosen = first = None
    for step in _STEP.finditer(spaced, start):
        if step["place"] is None:
            if chosen is not None:
                break
            continue
        name, rules = clean_name(line[step.end() :])
        if look_up(name):
            chosen = step.start(), name, rules
        elif name.casefold() not in _HANDS and step["place"].casefold() != "to":
            first = first or (step.start(), name, rules)
    taken = chosen or (None if only_known else first)
    return None if taken is None else (line[start : taken[0]].strip(EDGES), *taken[1:])


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
