"""The legs of a task: each goes to a place, for an object, and does something there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from er_gym.data.trajectory import Purpose, Subgoal
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.generate.words import in_or_on_the
from er_gym.tasks.task import KeyAction, Task, type_of_id


@dataclass(frozen=True)
class Leg:
    """A part of a task's key actions: one that navigates, and those up to the next such.

    Attributes:
        navigate: the key action that goes to the place; None if the task begins with another verb.
        thing: the type of the object that the agent is after at the place.
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
    """The legs of a task, without ``end``."""
    groups: list[tuple[KeyAction | None, list[KeyAction]]] = []
    for key in task.key_actions:
        if key.verb == verbs.NAVIGATE:
            groups.append((key, []))
        elif key.verb != verbs.END:
            if not groups:
                groups.append((None, []))
            groups[-1][1].append(key)
    parts = sum(key.verb == verbs.PUT for key in task.key_actions)
    return tuple(
        _leg(navigate, actions, [*after], parts > 1)
        for navigate, actions, after in (
            (*group, (key for _, later in groups[number + 1 :] for key in later))
            for number, group in enumerate(groups)
        )
    )


def _leg(
    navigate: KeyAction | None,
    actions: Sequence[KeyAction],
    later: Sequence[KeyAction],
    several: bool,
) -> Leg:
    related = () if navigate is None else navigate.related_objects
    place = "" if navigate is None else navigate.actual_type
    sought = type_of_id(related[-1]) if related else ""
    hidden = len(related) > 1 and not same_type(sought, place)
    main = next((key for key in actions if key.verb not in (verbs.OPEN, verbs.CLOSE)), None)
    thing = sought if hidden else (main.actual_type if main else sought or place)
    if not hidden and main is not None and main.verb == verbs.PUT:
        thing = place
    put = next((key for key in (*actions, *later) if key.verb == verbs.PUT), None)
    verb = main.verb if main else "find"
    destination = ""
    if (verb == verbs.PICKUP and put is not None) or (verb == verbs.PUT and put is not None):
        destination = put.actual_type
    text = ""
    if several and verb == verbs.PICKUP and destination:
        text = f"put the {thing} {in_or_on_the(destination)}"
    return Leg(
        navigate,
        thing,
        hidden,
        tuple(actions),
        Subgoal(verb=verb, thing=thing, place=destination, text=text),
    )


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
