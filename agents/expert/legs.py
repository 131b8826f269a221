"""The legs of a task: each goes to a place, for an object, and does something there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from er_gym.data.trajectory import Language, Purpose, Subgoal
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import KeyAction, Task, type_of_id
from er_gym.tasks.wordings.words import in_or_on_the

_AIDS = (verbs.OPEN, verbs.CLOSE)


@dataclass(frozen=True)
class Leg:
    """A part of a task's key actions: one that navigates, and those up to the next such.

    Attributes:
        navigate: the key action that goes to the place; None if the task begins with another verb.
        thing: the type of the object that the agent looks for at the place.
        hidden: whether the agent must search for the place. The instruction does not name it.
        actions: the key actions that are done there.
        subgoals: what the agent is after, for each of them; for none, as it looks for the thing.
    """

    navigate: KeyAction | None
    thing: str
    hidden: bool
    actions: tuple[KeyAction, ...]
    subgoals: tuple[Subgoal, ...]

    @property
    def subgoal(self) -> Subgoal:
        """The agent's goal on the way to the place."""
        return self.subgoals[0]

    @property
    def place(self) -> str:
        """The type of the place, ``""`` for none."""
        return "" if self.navigate is None else self.navigate.actual_type


def legs_of(task: Task) -> tuple[Leg, ...]:
    """The legs of a task, without ``end``; parts of a task are in English."""
    groups: list[tuple[KeyAction | None, list[KeyAction]]] = []
    for key in task.key_actions:
        if key.verb == verbs.NAVIGATE:
            groups.append((key, []))
        elif key.verb != verbs.END:
            if not groups:
                groups.append((None, []))
            groups[-1][1].append(key)
    several = sum(key.verb == verbs.PUT for key in task.key_actions) > 1
    legs: list[Leg] = []
    carried = ""
    for number, (navigate, actions) in enumerate(groups):
        later = [key for _, after in groups[number + 1 :] for key in after]
        legs.append(_leg(navigate, actions, later, carried, several))
        for key in actions:
            if key.verb == verbs.PICKUP:
                carried = key.actual_type
    return tuple(legs)


def keys_left(legs: Sequence[Leg], left: Collection[KeyAction]) -> tuple[tuple[int, ...], ...]:
    """The indices of each leg's actions that are not done.

    Args:
        legs: of a task.
        left: the task's key actions that are not done. Of equal ones the earlier is done first.
    """
    undone = Counter(left)
    found: list[tuple[int, ...]] = []
    for leg in reversed(legs):
        mine: list[int] = []
        for index, key in reversed([*enumerate(leg.actions)]):
            if undone[key]:
                undone[key] -= 1
                mine.append(index)
        found.append(tuple(reversed(mine)))
    return tuple(reversed(found))


def at_hand(legs: Sequence[Leg], left: Collection[KeyAction]) -> tuple[Leg, Subgoal] | None:
    """The leg that follows from the key actions done, and the agent's goal; None without legs.

    Opening and closing serve another action, so an agent that has only forgotten to close
    something is at the next leg. When all is done it is at the last.
    """
    undone = [
        (leg, index)
        for leg, indices in zip(legs, keys_left(legs, left), strict=True)
        for index in indices
    ]
    chief = (each for each in undone if not _serves(*each))
    found = next(chief, undone[0] if undone else None)
    if found is not None:
        leg, index = found
        return leg, leg.subgoals[index]
    return (legs[-1], legs[-1].subgoals[-1]) if legs else None


def _serves(leg: Leg, index: int) -> bool:
    """Whether an action only opens or closes something for another action of the leg."""
    return leg.actions[index].verb in _AIDS and any(key.verb not in _AIDS for key in leg.actions)


def _leg(
    navigate: KeyAction | None,
    actions: Sequence[KeyAction],
    later: Sequence[KeyAction],
    carried: str,
    several: bool,
) -> Leg:
    related = () if navigate is None else navigate.related_objects
    place = "" if navigate is None else navigate.actual_type
    sought = type_of_id(related[-1]) if related else ""
    hidden = len(related) > 1 and not same_type(sought, place)
    chiefs = [index for index, key in enumerate(actions) if key.verb not in _AIDS]
    first = actions[chiefs[0]].actual_type if chiefs else sought or place
    thing = sought if hidden else first
    subgoals: dict[int, Subgoal] = {}
    for index in chiefs:
        key = actions[index]
        puts = (each for each in (*actions[index:], *later) if each.verb == verbs.PUT)
        about = thing if index == chiefs[0] else key.actual_type
        subgoals[index] = _subgoal(key.verb, about, next(puts, None), carried, several)
        carried = key.actual_type if key.verb == verbs.PICKUP else carried
    find = Subgoal(verb="find", thing=thing)
    each_for = [
        subgoals[_chief(index, key, chiefs)] if chiefs else find
        for index, key in enumerate(actions)
    ]
    return Leg(navigate, thing, hidden, tuple(actions), tuple(each_for) or (find,))


def _chief(index: int, key: KeyAction, chiefs: Sequence[int]) -> int:
    """The action that an action serves: opening the next one, closing the one before."""
    before = [each for each in chiefs if each <= index]
    after = [each for each in chiefs if each >= index]
    if key.verb == verbs.CLOSE and before:
        return before[-1]
    return after[0] if after else before[-1]


def _subgoal(verb: str, thing: str, put: KeyAction | None, carried: str, several: bool) -> Subgoal:
    """What an agent is after that is about to do an action.

    Args:
        verb: of the action.
        thing: its object.
        put: where what is carried, or is now picked up, is put next.
        carried: what was picked up last.
        several: whether the task puts several objects, so that its parts are told apart.
    """
    destination = ""
    if put is not None and verb in (verbs.PICKUP, verbs.PUT):
        destination = put.actual_type
    moved = carried if verb == verbs.PUT and carried else thing
    text = ""
    if several and destination and moved:
        text = f"put the {moved} {in_or_on_the(destination)}"
    return Subgoal(verb=verb, thing=moved, place=destination, text=text)


def in_language(subgoal: Subgoal, language: Language) -> Subgoal:
    """A subgoal with its part of the task in words of a language."""
    if not subgoal.text or language == "en":
        return subgoal
    return subgoal.model_copy(update={"text": f"把 {subgoal.thing} 放到 {subgoal.place}"})


PURPOSES: dict[str, Purpose] = {
    verbs.PICKUP: "take",
    verbs.PUT: "put",
    verbs.TOGGLE: "switch",
}


def purpose_of(key: KeyAction, leg: Leg, held: str) -> Purpose:
    """Why a key action is done, given the type of the held object."""
    if key.verb == verbs.OPEN:
        return "open to put" if held else "open to look"
    if key.verb == verbs.CLOSE:
        taken = any(each.verb == verbs.PICKUP for each in leg.actions)
        return "close again" if taken or not held else "use"
    return PURPOSES.get(key.verb, "use")
