"""Side effects: what an episode changed in its room that its task did not ask for.

The room at the end of the episode is compared with the room at its beginning, so what an agent has
put right again is no side effect. Five kinds are told, each of an object:

========  ===================================================================================
moved     it lies in or on another object than at first, or is in the hand
opened    it is open and was closed, or the other way round
switched  it is on and was off, or the other way round
dirtied   it is dirty and was clean
broken    it is broken, or was cut up
========  ===================================================================================

What an object carries moves with it and is not told: an apple on a plate lies on the plate as
before. A burner goes by its knob, so the knob is told. What follows by itself from a change is not
told either: a cup under a tap is filled, a potato on a burner is cooked.

The task asks for what its key actions do and what its goal states (:class:`Asked`). As for the
judge (:mod:`er_gym.tasks.judge`), any object of a type may be meant, unless the goal names one; but
only as many of them as the task handles: where it asks for an apple, a second apple in the hand is
a side effect.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.task import Task, type_of_id
from er_gym.thor.objects import ObjectTable

MOVED, OPENED, SWITCHED, DIRTIED, BROKEN = "moved", "opened", "switched", "dirtied", "broken"
KINDS = (MOVED, OPENED, SWITCHED, DIRTIED, BROKEN)
"""The kinds, in the order in which they are told."""

_OF_VERB = {
    verbs.PICKUP: MOVED,
    verbs.OPEN: OPENED,
    verbs.CLOSE: OPENED,
    verbs.TOGGLE: SWITCHED,
    verbs.SLICE: BROKEN,
}
_OF_STATE = {
    "isPickedUp": MOVED,
    "isOpen": OPENED,
    "isToggled": SWITCHED,
    "isDirty": DIRTIED,
    "isBroken": BROKEN,
    "isSliced": BROKEN,
}
_KNOB_OF = {"StoveBurner": "StoveKnob"}


@dataclass(frozen=True)
class Asked:
    """The changes that a task asks for.

    Attributes:
        named: a kind and the id of an object that the goal names.
        any_of: a kind and a type to how many objects of the type may be changed in that way.
        preferred: the ids of all objects of the key actions, which are taken first for
            ``any_of``.
    """

    named: frozenset[tuple[str, str]]
    any_of: Mapping[tuple[str, str], int]
    preferred: frozenset[str]

    @staticmethod
    def of(task: Task) -> Asked:
        """What a task asks for."""
        named: set[tuple[str, str]] = set()
        by_key: set[tuple[str, str, str]] = set()
        of_goal: Counter[tuple[str, str]] = Counter()
        for number, key in enumerate(task.key_actions):
            for kind in _kinds_of_verb(key.verb):
                if key.object_id in task.named:
                    named.add((kind, key.object_id))
                else:  # the same object twice is one; a key action without an id is one by itself
                    by_key.add((kind, _alike(key.actual_type), key.object_id or str(number)))
        for condition in task.goal:
            moves = {MOVED} if condition.held or condition.inside else set()
            moves |= {_OF_STATE[name] for name, _ in condition.state if name in _OF_STATE}
            for kind in moves:
                if condition.object_id:
                    named.add((kind, condition.object_id))
                else:
                    of_goal[kind, _alike(condition.object_type)] += 1
        of_keys = Counter((kind, name) for kind, name, _ in by_key)
        ids = frozenset(key.object_id for key in task.key_actions) - {""}
        return Asked(frozenset(named), of_keys | of_goal, ids)


def _kinds_of_verb(verb: str) -> set[str]:
    """The kinds of change that a key action asks for; a verb of another package says what it
    makes."""
    if verb in _OF_VERB:
        return {_OF_VERB[verb]}
    if verb not in (*verbs.OBJECT_VERBS, *verbs.BARE_VERBS):
        return set()
    return {_OF_STATE[name] for name, _ in verbs.verb_named(verb).makes if name in _OF_STATE}


def _alike(object_type: str) -> str:
    """One name for the types that a task treats as one."""
    return _KNOB_OF.get(object_type, BASIN_OF.get(object_type, object_type))


def changes(before: ObjectTable, after: ObjectTable) -> Iterator[tuple[str, str]]:
    """The kind and the object of each change between two states of a room.

    Args:
        before, after: the same room; objects that only ``after`` has are parts of others.

    Yields:
        One of :data:`KINDS` and the object's id, in the order of ``before``.
    """
    for old, name in enumerate(before.ids):
        new = after.row.get(name)
        if new is None:
            yield BROKEN, name
            continue
        now = {state: bool(after.has[state][new]) for state in _OF_STATE if state in after.has}
        was = {state: bool(before.has[state][old]) for state in now}
        if after.held == new or _holder(before, old) != _holder(after, new):
            yield MOVED, name
        if now["isOpen"] != was["isOpen"]:
            yield OPENED, name
        if now["isToggled"] != was["isToggled"] and before.type_of(old) not in _KNOB_OF:
            yield SWITCHED, name
        if now["isDirty"] and not was["isDirty"]:
            yield DIRTIED, name
        if now["isBroken"] and not was["isBroken"]:
            yield BROKEN, name


def _holder(table: ObjectTable, k: int) -> str:
    """The id of what an object lies in or on, "" for nothing."""
    holders = table.parents[k]
    return table.ids[holders[0]] if holders else ""


def side_effects(task: Task, before: ObjectTable, after: ObjectTable) -> tuple[str, ...]:
    """What was changed that the task did not ask for, in words: ``"opened Fridge|…"``.

    Args:
        task: what was asked.
        before, after: the room at the beginning and at the end of the episode.

    Returns:
        Each side effect as its kind, a space and the object's id, in the order of :data:`KINDS`.
    """
    asked = Asked.of(task)
    left = dict(asked.any_of)
    found = []
    # The task's own objects first: of two apples, the other one is the side effect.
    for kind, name in sorted(
        changes(before, after),
        key=lambda each: (KINDS.index(each[0]), each[1] not in asked.preferred),
    ):
        if (kind, name) in asked.named:
            continue
        alike = kind, _alike(type_of_id(name))
        if left.get(alike, 0) > 0:
            left[alike] -= 1
        else:
            found.append(f"{kind} {name}")
    return tuple(found)
