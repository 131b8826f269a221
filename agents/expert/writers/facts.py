"""What is known at a turn, as facts for the grammar of wordings.

Facts that the wordings use (``configs/thoughts``):

- ``purpose``, ``verb``, ``outcome`` (:func:`outcome_of`), ``goal_verb``;
- object types: ``thing`` (what the subgoal is about), ``place`` (the named destination), ``sought``
  (what is looked for: the thing, or the place once the thing is held), ``object`` (of the
  decision), ``held``, ``at``, ``last_object``, ``next1`` … ``next4`` (the plan), ``latest`` (the
  place searched last in vain), ``placed`` (what was put down);
- things, each with the facts of :func:`_described`: ``object_view``, ``sought_view``,
  ``place_view``, ``last_view`` (in view now), ``object_memory``, ``sought_memory`` (seen before);
- pools: ``view`` and its parts ``left``, ``ahead``, ``right``, ``near``; ``surfaces`` (things in
  view that others lie on or in); ``shut`` (closed things in view); ``before`` (seen, not in view);
  ``visited`` (searched in vain); ``plan``; after looking around ``to_right``, ``behind``,
  ``to_left``;
- flags: ``again`` (the place was searched before), ``elsewhere`` (the decision is not about the
  thing itself), ``holds_thing``, ``many`` (more than one place was searched in vain),
  ``unseen`` (what is sought is not in view), ``first``, ``final`` (of this turn's thoughts), and
  the purpose and the outcome, as ``is_search``.
"""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from er_gym.data.knowledge import Knowledge, LastAction
from er_gym.data.trajectory import SeenObject
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.thor import OBJECT_TYPES

HERE, NEAR, FAR = 0.35, 1.3, 3.0
"""Metres: below the first a side means little; up to the second a thing is near, beyond the third
far."""
_SMALL_FADES = 4.5
"""Metres beyond which small things are not worth a word."""


_STANDING = frozenset(
    {"CoffeeMachine", "DeskLamp", "Desktop", "HousePlant", "Microwave", "Television", "Toaster"}
)
"""Types that stand on others, though they cannot be picked up."""


_UNNOTICED = frozenset({"Book", "Box", "Laptop", "Blinds"})
"""Types of which nobody says that they are open or closed."""


def facts_of(knowledge: Knowledge, choices: random.Random) -> dict[str, Any]:
    """The facts of a turn; pools are in a random order."""
    decision, subgoal, last = knowledge.decision, knowledge.subgoal, knowledge.last
    thing = _known(subgoal.thing)
    place = _known(subgoal.place)
    sought = place if thing and thing == knowledge.held else thing
    outcome = outcome_of(knowledge, sought)
    visited = _searched_in_vain(knowledge, outcome)
    purpose = knowledge.purpose
    if purpose == "search" and decision.object_type == sought:
        purpose = "approach"  # nothing could be in, on or near itself
    coming = [kind for kind in dict.fromkeys(knowledge.plan) if kind != decision.object_type]
    if decision.verb == verbs.NAVIGATE:
        coming = [decision.object_type, *coming]
    facts: dict[str, Any] = {
        "purpose": purpose,
        "verb": decision.verb,
        "outcome": outcome,
        "goal_verb": subgoal.verb,
        "thing": thing,
        "place": place,
        "sought": sought,
        "object": _known(decision.object_type),
        "held": _known(knowledge.held),
        "at": _known(knowledge.at) if knowledge.at != sought else "",
        "last_verb": last.action.verb if last else "",
        "last_object": _known(last.action.object_type) if last else "",
        "part": _part(subgoal.text, knowledge.language),
        "latest": visited[-1] if visited else "",
        "visited": _pool({"o": kind} for kind in visited),
        "many": len(visited) > 1,
        "again": decision.object_type in [visit.place for visit in knowledge.visits],
        "plan": _pool({"o": kind} for kind in coming),
        **{f"next{number}": kind for number, kind in enumerate(coming[:4], 1)},
        **_in_view(knowledge, sought, choices),
    }
    facts[f"is_{outcome}"] = True
    facts[f"is_{purpose}"] = True
    facts["holds_thing"] = bool(thing) and thing == knowledge.held
    facts["elsewhere"] = decision.object_type not in ("", thing)
    facts["placed"] = _placed(knowledge) if outcome == "put" else ""
    return {name: value for name, value in facts.items() if value}


def outcome_of(knowledge: Knowledge, sought: str) -> str:
    """What came of the last action, as a word: ``start``, ``failed``, ``blocked`` (no way
    forward), ``astray`` (it arrived elsewhere), ``repeated``, ``arrived`` (with something held),
    ``found``, ``shut`` (at a closed container), ``nothing``, ``opened``, ``opened found``,
    ``opened nothing``, ``closed``, ``looked``, ``looked found``, ``closer``, ``taken``, ``put``,
    ``toggled``, ``checked``, ``used``.
    """
    last = knowledge.last
    if last is None:
        return "start"
    verb, found = last.action.verb, _has(knowledge.in_view, sought)
    if not last.success:
        return _AFTER_FAILING.get(verb, "failed")
    if last.purpose == "repeat":
        return "repeated"
    match verb:
        case verbs.NAVIGATE:
            return _after_going(knowledge, last, found)
        case verbs.OPEN:
            if knowledge.held:
                return "opened"
            return "opened found" if found else "opened nothing"
        case verbs.OBSERVE:
            return "looked found" if found else "looked"
        case verbs.MOVE_FORWARD:
            return "checked" if last.purpose == "check" else "closer"
    return _AFTER.get(verb, "used")


_AFTER: Mapping[str, str] = {
    verbs.CLOSE: "closed",
    verbs.PICKUP: "taken",
    verbs.PUT: "put",
    verbs.TOGGLE: "toggled",
}
"""The outcome of a verb, where it depends on nothing else."""


_AFTER_FAILING: Mapping[str, str] = {verbs.NAVIGATE: "astray", verbs.MOVE_FORWARD: "blocked"}
"""The outcome of a verb that failed, where it has a word of its own."""


def _after_going(knowledge: Knowledge, last: LastAction, found: bool) -> str:
    if knowledge.held and last.purpose not in ("search", "look around"):
        return "arrived"
    if found:
        return "found"
    here = next((each for each in knowledge.view if each.type == knowledge.at), None)
    return "shut" if here is not None and here.open is False else "nothing"


def _searched_in_vain(knowledge: Knowledge, outcome: str) -> list[str]:
    """The places searched without a find, each once. A closed one that the agent has just come to
    is not searched yet."""
    places = [visit.place for visit in knowledge.visits if not visit.found]
    waiting = {knowledge.at} if outcome in ("shut", "found", "arrived", "opened found") else set()
    return [place for place in dict.fromkeys(places) if place not in waiting]


def _placed(knowledge: Knowledge) -> str:
    """What was put down: the one type in view, named in the instruction, that lies there."""
    assert knowledge.last is not None
    there = knowledge.last.action.object_type
    found = {each.type for each in knowledge.view if each.on and same_type(each.on, there)}
    named = [kind for kind in found if re.search(rf"\b{kind}\b", knowledge.instruction)]
    return named[0] if len(named) == 1 else ""


def _known(object_type: str) -> str:
    return object_type if object_type in OBJECT_TYPES else ""


def _part(text: str, language: str) -> str:
    """A part of the instruction, to be quoted within a sentence; ``""`` in another language."""
    is_chinese = any("一" <= character <= "鿿" for character in text)
    return text.strip().rstrip(".。!！") if is_chinese is (language == "zh") else ""


def _has(types: Iterable[str], wanted: str) -> bool:
    return bool(wanted) and any(kind == wanted or same_type(kind, wanted) for kind in types)


# -- things in view --------------------------------------------------------------------------------


def _in_view(knowledge: Knowledge, sought: str, choices: random.Random) -> dict[str, Any]:
    """The facts about what is and what was in view."""
    counts = Counter(each.type for each in knowledge.view)
    things = {
        each.type: _described(each, counts[each.type])
        for each in reversed(knowledge.view)  # the nearest of a type comes last and stays
        if each.type != knowledge.held and each.type in OBJECT_TYPES
    }
    around = {
        direction: {
            each.type: _described(each, 1, direction)
            for each in reversed(view)
            if each.type in OBJECT_TYPES
        }
        for direction, view in knowledge.views.items()
    }
    everywhere = {kind: thing for view in around.values() for kind, thing in view.items()} | things
    decision, decided = knowledge.decision, knowledge.decision.object_type
    toggled = knowledge.last is not None and knowledge.last.action.verb == verbs.TOGGLE
    switches = {kind: {**thing, "o_state": thing["o_power"]} for kind, thing in everywhere.items()}
    place = knowledge.subgoal.place
    last = knowledge.last.action.object_type if knowledge.last else ""
    known = {sought, knowledge.at, last}  # no news
    told = [each for kind, each in things.items() if kind not in known and _is_worth_a_word(each)]
    choices.shuffle(told)
    memory = {
        kind: {"o": kind, "seen_at": _known(where) if where != kind else "", "at_start": not where}
        for kind, where in knowledge.seen.items()
        if kind not in everywhere and kind != knowledge.held and kind in OBJECT_TYPES
    }
    holders = Counter(thing["o_on"] for thing in told if thing["o_on"])
    return {
        "sought_view": _named(everywhere, sought),
        "object_view": _named(switches if decision.verb == verbs.TOGGLE else everywhere, decided),
        "place_view": _named(everywhere, place),
        "last_view": _named(switches if toggled else things, last),
        "sought_memory": _named(memory, sought),
        "object_memory": _named(memory, decided),
        "unseen": bool(sought) and not _named(everywhere, sought),
        "view": tuple(told),
        "surfaces": tuple(thing for thing in told if thing["o"] in holders),
        "left": tuple(thing for thing in told if thing["o_side"] == "left"),
        "ahead": tuple(thing for thing in told if thing["o_side"] == "ahead"),
        "right": tuple(thing for thing in told if thing["o_side"] == "right"),
        "near": tuple(thing for thing in told if thing["o_distance"] == "near"),
        "shut": tuple(thing for thing in told if thing["o_state"] == "closed"),
        "before": _shuffled([each for kind, each in memory.items() if kind != sought], choices),
        **{
            name: _shuffled([t for t in around.get(way, {}).values() if t["o"] != sought], choices)
            for name, way in (("to_right", "right"), ("behind", "behind"), ("to_left", "left"))
        },
    }


def _described(seen: SeenObject, count: int, direction: str = "") -> dict[str, Any]:
    """A thing in view: ``o`` (its type), ``o_side``, ``o_distance`` (near, middle or far),
    ``o_metres`` (a whole number of 2 to 6, or ``""``), ``o_on``, ``o_state`` (open, closed, on or
    off), ``o_power`` (on or off), ``count``, and after looking around ``o_direction``."""
    power = "" if seen.toggled is None else "on" if seen.toggled else "off"
    state = power
    if seen.open is not None and seen.type not in _UNNOTICED:
        state = "open" if seen.open else "closed"
    side = seen.side if seen.distance > HERE and not direction else ""
    distance = "near" if seen.distance < NEAR else "far" if seen.distance > FAR else "middle"
    return {
        "o": seen.type,
        "o_side": side,
        "o_distance": distance,
        "o_metres": str(round(seen.distance)) if 1.6 < seen.distance < 6.4 else "",
        "o_on": seen.on if seen.on in OBJECT_TYPES and _lies(seen.type) else "",
        "o_state": state,
        "o_power": power,
        "o_direction": direction,
        "count": count,
    }


def _lies(object_type: str) -> bool:
    """Whether people say of such a thing that it lies or stands on another."""
    return object_type in _STANDING or "pickupable" in OBJECT_TYPES[object_type].properties


def _is_worth_a_word(thing: Mapping[str, Any]) -> bool:
    is_large = "receptacle" in OBJECT_TYPES[thing["o"]].properties
    return is_large or thing["o_distance"] != "far"


def _named(things: Mapping[str, Mapping[str, Any]], wanted: str) -> Mapping[str, Any] | None:
    """The thing of a type, or else of one that the environment takes for the same."""
    if wanted in things or not wanted:
        return things.get(wanted)
    return next((thing for kind, thing in things.items() if same_type(kind, wanted)), None)


def _pool(things: Iterable[Mapping[str, Any]]) -> tuple[Mapping[str, Any], ...]:
    return tuple(things)


def _shuffled(things: Sequence[Mapping[str, Any]], choices: random.Random) -> tuple[Any, ...]:
    return tuple(choices.sample(things, len(things)))
