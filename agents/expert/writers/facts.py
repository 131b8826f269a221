"""The agent's knowledge at a turn, as facts for the grammar of wordings.

Facts that the wordings use (``configs/thoughts``):

- ``purpose`` (a turn's, or ``recall``: to go to what was seen before and is not in view),
  ``verb``, ``outcome`` (:func:`agents.expert.writers.outcomes.outcome_of`),
  ``goal_verb``; ``problem`` (why an action was refused), ``closing`` (why a container is closed:
  taken, placed or empty), ``ended`` (what the end shows: put, pickup, toggle or find), ``power``
  (whether the thing is on or off);
- object types: ``thing`` (what the subgoal is about), ``place`` (the named destination), ``sought``
  (what is looked for: the thing, or the place once the thing is held), ``object`` (of the
  decision), ``held``, ``at``, ``last_object``, ``arrived_at`` (where a walk that went wrong ended),
  ``next1`` … ``next3`` (the plan without the places searched already), ``latest`` (the place
  searched last in vain), ``placed`` (what was put down just now); in a task of several parts
  ``later_thing`` (of the part to come), ``done_thing`` and ``done_place`` (of the part done);
- things, each with the facts of :func:`_described`: ``object_view``, ``sought_view``,
  ``place_view``, ``last_view`` (in view now), ``object_memory``, ``sought_memory``,
  ``place_memory`` (seen before, with ``seen_at``, ``at_start`` and ``o_on``);
- pools: ``view`` and its parts ``left``, ``ahead``, ``right``, ``near``; ``here`` (things that lie
  where the agent searched); ``shut`` (closed things in view); ``visited`` (searched in vain);
  ``plan``; ``recalled`` (what is sought, if it was seen before and is not in view); after looking
  around ``to_right``, ``behind``, ``to_left``;
- flags: ``again`` (the place was searched before), ``lies_there`` and ``on_last`` (what is sought
  is seen to lie at the decision's object, at the last action's), ``elsewhere`` (the decision is not
  about the thing itself), ``holds_thing``, ``many`` (more than one place was searched in vain),
  ``typical`` (people often keep such a thing at the decision's object, which was not found to hold
  something else), ``far_fetched`` (they hardly do), ``lay_there`` (what is recalled lay at the
  decision's object), ``near_only`` (it does not, nor is it the thing itself), ``long_search``
  (several places were searched for what is held), ``unseen`` (what is sought is not in view),
  ``several`` (the task has several parts), ``second`` (one of them
  is done), ``earned`` (the last action did a key action), ``told`` (it has been said where what is
  sought is), ``next_part`` (one of them has just been done, and another begins), ``first``,
  ``final`` (of this turn's thoughts), and the purpose and the outcome, as ``is_search``.
"""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from agents.expert.writers.outcomes import arrived_at, outcome_of, problem_of
from agents.scripted.searcher import search_priors
from er_gym.data.knowledge import Knowledge
from er_gym.data.mentions import named_in
from er_gym.data.trajectory import SeenObject
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among, same_type
from er_gym.thor import OBJECT_TYPES

HERE, NEAR, FAR = 0.35, 1.3, 3.0
"""Metres: below the first a side means little; up to the second a thing is near, beyond the third
far."""
_TYPICAL, _UNUSUAL = 1.0, 0.2
"""Likelihoods from which a place is typical for a thing, and below which it is far-fetched."""


_TELLING = frozenset({"found", "looked found", "opened found", "detour"})
"""Outcomes whose wordings tell where what is sought is."""


_STANDING = frozenset(
    {"CoffeeMachine", "DeskLamp", "Desktop", "HousePlant", "Microwave", "Television", "Toaster"}
)
"""Types that stand on others, though they cannot be picked up."""


_LONG = 2
"""So many searches in vain make a search long."""
_UNNOTICED = frozenset({"Book", "Box", "Laptop", "Blinds"})
"""Types of which nobody says that they are open or closed."""


def facts_of(knowledge: Knowledge, choices: random.Random) -> dict[str, Any]:
    """The facts of a turn; pools are in a random order."""
    decision, subgoal, last = knowledge.decision, knowledge.subgoal, knowledge.last
    thing, place = _known(subgoal.thing), _known(subgoal.place)
    sought = place if thing and thing == knowledge.held else thing
    outcome = outcome_of(knowledge, sought)
    visited = _searched_in_vain(knowledge, outcome)
    done = {*visited, decision.object_type}
    coming = [kind for kind in dict.fromkeys(knowledge.plan) if kind not in done]
    if decision.verb == verbs.NAVIGATE:
        coming = [decision.object_type, *coming]
    view = _in_view(knowledge, sought, choices)
    lies_on = (view["sought_view"] or {}).get("o_on", "")
    purpose: str = knowledge.purpose
    if purpose == "search" and (decision.object_type == sought or lies_on):
        purpose = "approach"  # nobody searches for what is in view
    recalled = view["sought_memory"]
    if purpose == "approach" and recalled:
        purpose = "recall"
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
        "problem": problem_of(last) if last else "",
        "arrived_at": arrived_at(last) if last else "",
        "latest": visited[-1] if visited else "",
        "visited": _pool({"o": kind} for kind in visited),
        "many": len(visited) > 1,
        "again": decision.object_type in [visit.place for visit in knowledge.visits],
        "lies_there": bool(lies_on) and same_type(lies_on, decision.object_type),
        "recalled": (recalled,) if recalled else (),
        "lay_there": bool(recalled) and _is_at(recalled, decision.object_type),
        "on_last": last is not None
        and bool(lies_on)
        and same_type(lies_on, last.action.object_type),
        "plan": _pool({"o": kind} for kind in coming),
        **{f"next{number}": kind for number, kind in enumerate(coming[:3], 1)},
        **view,
        **_story(knowledge, thing),
    }
    if thing and decision.object_type in OBJECT_TYPES and thing in search_priors.placement_table():
        likelihood = search_priors.likelihood(thing, decision.object_type)
        usual = likelihood >= _TYPICAL and decision.object_type != "GarbageCan"
        holds = [on for kind, on in knowledge.lay.items() if not same_type(kind, thing)]
        facts["typical"] = usual and not is_among(decision.object_type, (*holds, *visited))
        facts["far_fetched"] = likelihood < _UNUSUAL
    facts["earned"] = last is not None and last.earned
    facts["told"] = outcome in _TELLING
    facts[f"is_{outcome}"] = True
    facts[f"is_{purpose}"] = True
    facts["holds_thing"] = bool(thing) and thing == knowledge.held
    facts["elsewhere"] = decision.object_type not in ("", thing)
    known = facts["lies_there"] or facts["lay_there"] or decision.object_type == sought
    facts["near_only"] = bool(sought) and not known
    return {name: value for name, value in facts.items() if value}


def _story(knowledge: Knowledge, thing: str) -> dict[str, Any]:
    """What was done so far, and what is still to come in a task of several parts."""
    held, last, subgoal = "", knowledge.last, knowledge.subgoal
    puts: list[tuple[str, str]] = []
    toggled = False
    latest = ""
    closing = "empty"
    in_vain = 0
    for each in knowledge.actions:
        if not each.success:
            continue
        verb = each.action.verb
        in_vain += each.purpose in ("search", "look around") and not each.earned
        if verb == verbs.PICKUP:
            held, closing = each.action.object_type, "taken"
        elif verb == verbs.PUT and held:
            latest, closing, in_vain = held, "placed", 0
            if each.earned:
                puts.append((_known(held), _known(each.action.object_type)))
        elif verb == verbs.TOGGLE:
            toggled = toggled or same_type(each.action.object_type, thing)
        elif verb == verbs.OPEN:
            closing = "empty" if not knowledge.held else "taken"
    several = bool(subgoal.text)
    begins = bool(puts) and subgoal.thing != puts[-1][0]
    put_now = last is not None and last.success and last.action.verb == verbs.PUT
    story: dict[str, Any] = {
        "placed": _known(latest) if put_now else "",
        "several": several,
        "second": several and begins,
        "next_part": several and begins and put_now,
        "closing": closing,
        "long_search": in_vain >= _LONG,
        "ended": _ended(knowledge, thing, puts, toggled),
    }
    others = [pair for pair in puts if pair[0] != subgoal.thing]
    if several and others:
        story["done_thing"], story["done_place"] = others[-1]
    if several and not puts:
        pairs = {subgoal.thing, subgoal.place}
        named = [kind for kind in named_in(knowledge.instruction) if kind not in pairs]
        carried = [kind for kind in named if _is_carried(kind)]
        story["later_thing"] = carried[0] if len(carried) == 1 else ""
    return story


def _ended(knowledge: Knowledge, thing: str, puts: Sequence[tuple[str, str]], toggled: bool) -> str:
    """What the agent can point at when it ends."""
    verb, place = knowledge.subgoal.verb, knowledge.subgoal.place
    if verb == verbs.PUT and puts and puts[-1][0] == thing and same_type(puts[-1][1], place):
        return "put"
    if verb == verbs.PICKUP and thing and thing == knowledge.held:
        return "pickup"
    if verb == verbs.TOGGLE and toggled:
        return "toggle"
    return "find" if verb == "find" and thing in knowledge.in_view else ""


def _is_at(memory: Mapping[str, Any], place: str) -> bool:
    return any(kind and same_type(kind, place) for kind in (memory["o_on"], memory["o"]))


def _is_carried(kind: str) -> bool:
    return "pickupable" in OBJECT_TYPES[kind].properties


def _searched_in_vain(knowledge: Knowledge, outcome: str) -> list[str]:
    """The places searched without a find, each once. A closed one that the agent has just come to
    is not searched yet."""
    places = [visit.place for visit in knowledge.visits if not visit.found]
    waiting = {knowledge.at} if outcome in ("shut", "found", "arrived", "opened found") else set()
    return [place for place in dict.fromkeys(places) if place not in waiting]


def _known(object_type: str) -> str:
    return object_type if object_type in OBJECT_TYPES else ""


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
        kind: {
            "o": kind,
            "seen_at": _known(where) if where not in (kind, knowledge.lay.get(kind)) else "",
            "at_start": not where,
            "o_on": _known(knowledge.lay.get(kind, "")) if _lies(kind) else "",
        }
        for kind, where in knowledge.seen.items()
        if kind not in everywhere and kind != knowledge.held and kind in OBJECT_TYPES
    }
    searched = last if knowledge.last and knowledge.last.action.verb == verbs.OPEN else knowledge.at
    lying = [each for each in things.values() if each["o_on"] and searched]
    here = [each for each in lying if same_type(each["o_on"], searched) and each["o"] != sought]
    thing = _named(switches, _known(knowledge.subgoal.thing))
    return {
        "sought_view": _named(everywhere, sought),
        "object_view": _named(switches if decision.verb == verbs.TOGGLE else everywhere, decided),
        "place_view": _named(everywhere, place),
        "last_view": _named(switches if toggled else things, last),
        "sought_memory": _named(memory, sought),
        "object_memory": _named(memory, decided),
        "place_memory": _named(memory, place),
        "unseen": bool(sought) and not _named(everywhere, sought),
        "view": tuple(told),
        "here": tuple(here),
        "power": thing["o_state"] if thing and not knowledge.held else "",
        "left": tuple(thing for thing in told if thing["o_side"] == "left"),
        "ahead": tuple(thing for thing in told if thing["o_side"] == "ahead"),
        "right": tuple(thing for thing in told if thing["o_side"] == "right"),
        "near": tuple(thing for thing in told if thing["o_distance"] == "near"),
        "shut": tuple(thing for thing in told if thing["o_state"] == "closed"),
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
