"""The legs of a task: each goes to a place, for an object, and does something there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from er_gym.data.trajectory import Language, Purpose, Subgoal
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.generate.words import in_or_on_the
from er_gym.tasks.task import KeyAction, Task, type_of_id


@dataclass(frozen=True)
class Leg:
    """A part of a task's key actions: one that navigates, and those up to the next such.

    Attributes:
        navigate: the key action that goes to the place; None if the task begins with another verb.
        thing: the type of the object that the agent looks for at the place.
        hidden: whether the agent must search for the place. The instruction does not name it.
        actions: the key actions that are done there.
        subgoal: what the agent is after.
    """

    navigate: KeyAction | None
    thing: str
    hidden: bool
    actions: tuple[KeyAction, ...]
    subgoal: Subgoal

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
    main = next((key for key in actions if key.verb not in (verbs.OPEN, verbs.CLOSE)), None)
    verb = main.verb if main else "find"
    thing = sought if hidden else (main.actual_type if main else sought or place)
    put = next((key for key in (*actions, *later) if key.verb == verbs.PUT), None)
    destination = ""
    if put is not None and verb in (verbs.PICKUP, verbs.PUT):
        destination = put.actual_type
    moved = carried if verb == verbs.PUT and carried else thing
    text = ""
    if several and destination and moved:
        text = f"put the {moved} {in_or_on_the(destination)}"
    return Leg(
        navigate,
        thing,
        hidden,
        tuple(actions),
        Subgoal(verb=verb, thing=moved, place=destination, text=text),
    )


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
