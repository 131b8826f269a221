"""The result of the last action, as a keyword for the grammar of wordings."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from er_gym.data.knowledge import Knowledge, LastAction
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.thor import OBJECT_TYPES

_ARRIVED = re.compile(r"you arrived at (\w+) instead")
_PROBLEMS: tuple[tuple[str, str], ...] = (
    ("within reach", "reach"),
    ("close enough to see", "unknown"),
    ("already; put it down", "full"),
    ("hand is empty", "empty"),
    ("It is closed", "closed"),
    ("open already", "open"),
    ("closed already", "shut"),
)
"""Words of the environment's feedback, and the problem that they tell."""


def outcome_of(knowledge: Knowledge, sought: str) -> str:
    """What came of the last action.

    One of ``start``; after an action that was not done ``failed`` (the arm), ``astray`` (it arrived
    elsewhere), ``blocked`` (no way forward), ``refused`` (not legal); after a mistake ``wrong
    object``, ``wrong place``, ``wrong switch``, ``detour`` (it went away from what is in view),
    ``repeated``; otherwise ``arrived`` (with something held), ``found``, ``shut`` (at a closed
    container), ``nothing``, ``opened``, ``opened found``, ``opened nothing``, ``closed``,
    ``looked``, ``looked found``, ``closer``, ``taken``, ``put``, ``put away``, ``toggled``,
    ``checked``, ``used``.
    """
    last = knowledge.last
    if last is None:
        return "start"
    if not last.success:
        return _after_failing(last)
    if last.purpose == "repeat":
        return "repeated"
    verb, found = last.action.verb, _has(knowledge.in_view, sought)
    mistake = _mistake(knowledge, last)
    if mistake:
        return mistake
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
        case verbs.PUT:
            return "put away" if last.purpose == "put down" else "put"
    return _AFTER.get(verb, "used")


def problem_of(last: LastAction) -> str:
    """Why an action was refused: ``reach`` (not within reach), ``unknown`` (a place not seen yet),
    ``full`` or ``empty`` (the hand), ``closed``, ``open``, ``shut``; ``""`` if it was not."""
    if last.success or last.fault:
        return ""
    return next((problem for words, problem in _PROBLEMS if words in last.feedback), "other")


def arrived_at(last: LastAction) -> str:
    """The type at which a walk that went wrong ended, ``""`` if the feedback names none."""
    found = None if last.success else _ARRIVED.search(last.feedback)
    return found[1] if found and found[1] in OBJECT_TYPES else ""


_AFTER: Mapping[str, str] = {
    verbs.CLOSE: "closed",
    verbs.PICKUP: "taken",
    verbs.TOGGLE: "toggled",
}
"""The outcome of a verb, where it depends on nothing else."""


def _after_failing(last: LastAction) -> str:
    if last.action.verb == verbs.MOVE_FORWARD:
        return "blocked"
    if not last.fault:
        return "refused"
    return "astray" if last.action.verb == verbs.NAVIGATE else "failed"


def _mistake(knowledge: Knowledge, last: LastAction) -> str:
    """The word for an action that was done but served nothing, ``""`` if it was none."""
    if last.earned:
        return ""
    verb, goal = last.action.verb, knowledge.subgoal
    other = bool(goal.thing) and not same_type(last.action.object_type, goal.thing)
    if verb == verbs.PICKUP and other:
        return "wrong object"
    if verb == verbs.TOGGLE and other:
        return "wrong switch"
    if verb == verbs.PUT and last.purpose == "put" and goal.place:
        return "" if same_type(last.action.object_type, goal.place) else "wrong place"
    goes_on = knowledge.decision.verb == verbs.NAVIGATE and last.purpose == "approach"
    if verb == verbs.NAVIGATE and goes_on and _has(knowledge.in_view, goal.thing):
        return "detour"
    return ""


def _after_going(knowledge: Knowledge, last: LastAction, found: bool) -> str:
    if knowledge.held and last.purpose not in ("search", "look around"):
        return "arrived"
    if found:
        return "found"
    here = next((each for each in knowledge.view if each.type == knowledge.at), None)
    opens = knowledge.decision.verb == verbs.OPEN
    return "shut" if opens and here is not None and here.open is False else "nothing"


def _has(types: Iterable[str], wanted: str) -> bool:
    return bool(wanted) and any(kind == wanted or same_type(kind, wanted) for kind in types)
