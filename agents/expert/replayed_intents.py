"""Infers the reason for an action of a recorded episode from the task."""

from __future__ import annotations

from collections.abc import Sequence

from agents.expert.course import Intent, View
from agents.expert.legs import Leg, at_hand
from agents.expert.memory import Memory, Sighting
from er_gym.data.trajectory import Purpose, Subgoal
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among, same_type


def replayed_intent(
    action: Action,
    view: View,
    legs: Sequence[Leg],
    *,
    train: bool,
    again: bool = False,
    memory: Memory | None = None,
) -> Intent:
    """The probable intent of an action.

    Args:
        action: what was done.
        view: the environment's answer before the action.
        legs: of the task.
        train: whether the turn is to be learnt from.
        again: whether the same action has just been refused.
        memory: what the agent has seen: who goes where a thing was does not search for it.
    """
    here = at_hand(legs, view.left)
    subgoal = here[1] if here else Subgoal()
    # What is held goes to its place; until the agent sees that, it looks for it.
    place = subgoal.place if view.held and subgoal.thing == view.held else ""
    sought = place or (here[0].thing if here else "")
    purpose = replayed_purpose(action, view.held, place)
    if again:
        purpose = "retry"
    elif purpose == "search" and (
        _in_view(sought, view) or _goes_back(action, memory.of(sought) if memory else None)
    ):
        purpose = "approach"
    return Intent(
        action,
        purpose,
        subgoal,
        plan=(action.object_type,) if action.verb == verbs.NAVIGATE else (),
        train=train,
    )


def replayed_purpose(action: Action, held: str, place: str = "") -> Purpose:
    """The probable reason for an action.

    Args:
        action: what was done.
        held: the type of the held object, ``""`` for none.
        place: the type of where it goes; ``""`` if it is unknown.
    """
    brings = bool(held) and (not place or same_type(action.object_type, place))
    if action.verb == verbs.NAVIGATE:
        return "carry" if brings else "search"
    if action.verb == verbs.OPEN:
        return "open to put" if brings else "open to look"
    return _PURPOSES.get(action.verb, "use")


_PURPOSES: dict[str, Purpose] = {
    verbs.PICKUP: "take",
    verbs.PUT: "put",
    verbs.TOGGLE: "switch",
    verbs.CLOSE: "close again",
    verbs.OBSERVE: "look around",
    verbs.MOVE_FORWARD: "get closer",
    verbs.END: "finish",
}


def _goes_back(action: Action, seen: Sighting | None) -> bool:
    return seen is not None and is_among(action.object_type, (seen.on, seen.thing))


def _in_view(thing: str, view: View) -> bool:
    return view.held != thing and any(same_type(name, thing) for name in view.visible)
