"""What may be navigated to and interacted with now: the paper's rules, as pure functions.

Objects are AI2-THOR object metadata; positions are metres in AI2-THOR's world frame.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from math import hypot
from typing import Any

from er_gym.envs.actions import INDEX_OF, STANDS_FOR, Action, applies
from er_gym.tasks import verbs

Objects = Mapping[str, Mapping[str, Any]]
"""Object metadata by object id, in scene order."""


def by_id(metadata: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """The objects of an event's metadata by their ids."""
    return {entry["objectId"]: entry for entry in metadata["objects"]}


def is_navigable(entry: Mapping[str, Any], agent: Mapping[str, float]) -> bool:
    """Whether an object is plain enough to see that one could walk to it.

    Args:
        entry: the object's metadata.
        agent: the agent's position, metres.

    The paper's rule: with V the volume of the object's axis-aligned box (m³), S its largest face
    (m²) and d the horizontal distance from the agent to the box's centre (m).
    """
    if not entry["visible"] or entry["isPickedUp"] or entry["objectType"] == "Floor":
        return False
    box = entry["axisAlignedBoundingBox"]
    size, centre = box["size"], box["center"]
    x, y, z = size["x"], size["y"], size["z"]
    volume = x * y * z
    face = max(x * y, y * z, x * z)
    distance = hypot(centre["x"] - agent["x"], centre["z"] - agent["z"])
    return (
        distance < 1
        or (face > 0.5 and distance < 10)
        or (face > 0.15 and distance < 4)
        or (face > 0.08 and distance < 2.5)
        or (volume > 0.005 and distance < 2)
        or (volume > 0.001 and distance < 1.5)
        or (volume >= 0.01 and volume / distance > 0.02)
    )


@dataclass(frozen=True)
class Surroundings:
    """What the agent can do things to, now.

    Attributes:
        objects: all of the scene.
        navigable: ids of objects that satisfy :func:`is_navigable` now.
        interactable: ids of objects that may be interacted with now.
        holding: id of the object in hand, "" when there is none.
    """

    objects: Objects
    navigable: tuple[str, ...]
    interactable: tuple[str, ...]
    holding: str

    def types(self, ids: Iterable[str]) -> frozenset[str]:
        """The types of some objects."""
        return frozenset(self.objects[i]["objectType"] for i in ids)


def surroundings(metadata: Mapping[str, Any], nearby_types: Collection[str]) -> Surroundings:
    """Judge an event's metadata.

    Args:
        nearby_types: the types of what lies in the receptacle last navigated to; things of these
            types can be interacted with wherever they are visible.
    """
    objects = by_id(metadata)
    agent = metadata["agent"]["position"]
    navigable = tuple(i for i, entry in objects.items() if is_navigable(entry, agent))
    plain = set(navigable)
    interactable = tuple(
        i
        for i, entry in objects.items()
        if i in plain
        or (entry["visible"] and not entry["isPickedUp"] and entry["objectType"] in nearby_types)
    )
    held = metadata["inventoryObjects"]
    return Surroundings(objects, navigable, interactable, held[0]["objectId"] if held else "")


def _takes(entry: Mapping[str, Any]) -> bool:
    return bool(entry["receptacle"]) or entry["objectType"] in STANDS_FOR


@dataclass(frozen=True)
class _Condition:
    """Which objects a verb can be done to in their present state, and what to say of others."""

    holds: Callable[[Mapping[str, Any]], bool]
    otherwise: str


_CONDITIONS = {
    verbs.PICKUP: _Condition(lambda entry: entry["pickupable"], "It cannot be picked up."),
    verbs.PUT: _Condition(
        lambda entry: _takes(entry) and (entry["isOpen"] or not entry["openable"]),
        "It is closed, or nothing can be put into it.",
    ),
    verbs.OPEN: _Condition(
        lambda entry: entry["openable"] and not entry["isOpen"],
        "It is open already, or does not open.",
    ),
    verbs.CLOSE: _Condition(
        lambda entry: entry["openable"] and entry["isOpen"],
        "It is closed already, or does not close.",
    ),
    verbs.TOGGLE: _Condition(
        lambda entry: entry["toggleable"] or entry["objectType"] == "StoveBurner",
        "It has no switch.",
    ),
}


def suited(verb: str, around: Surroundings) -> list[str]:
    """Ids of the interactable objects that the verb can be done to in their present state."""
    if (verb == verbs.PICKUP and around.holding) or (verb == verbs.PUT and not around.holding):
        return []
    holds, objects = _CONDITIONS[verb].holds, around.objects
    return [i for i in around.interactable if holds(objects[i])]


def objection(action: Action, around: Surroundings, known: Collection[str]) -> str:
    """Why an action is illegal now, in words for the agent; "" when it is legal.

    Args:
        known: types that may be navigated to (whatever was navigable before still is).
    """
    name = action.object_type
    if action.verb in verbs.BARE_VERBS:
        return ""
    if action.verb == verbs.NAVIGATE:
        if name in known:
            return ""
        return (
            f"You cannot navigate to {name}: none has been close enough to see clearly. "
            f"You could go to: {_listing(known)}."
        )
    if not applies(action.verb, name):
        return f"You cannot {action.verb} {name}. {_CONDITIONS[action.verb].otherwise}"
    if action.verb == verbs.PICKUP and around.holding:
        return f"You hold {_type(around, around.holding)} already; put it down first."
    if action.verb == verbs.PUT and not around.holding:
        return "Your hand is empty; pick something up first."
    in_reach = [i for i in around.interactable if _type(around, i) == name]
    if not in_reach:
        near = _listing(around.types(around.interactable))
        return (
            f"You cannot {action.verb} {name}: none is within reach and in view. There is: {near}."
        )
    if not any(_CONDITIONS[action.verb].holds(around.objects[i]) for i in in_reach):
        return f"You cannot {action.verb} {name}. {_CONDITIONS[action.verb].otherwise}"
    return ""


def legal_indices(around: Surroundings, known: Collection[str]) -> list[int]:
    """The index of every action to which :func:`objection` has none."""
    pairs = [(verb, "") for verb in verbs.BARE_VERBS]
    pairs += [(verbs.NAVIGATE, name) for name in known]
    for verb in verbs.INTERACTIONS:
        pairs += [(verb, name) for name in around.types(suited(verb, around))]
    return [INDEX_OF[pair] for pair in pairs if pair in INDEX_OF]


def _type(around: Surroundings, object_id: str) -> str:
    return str(around.objects[object_id]["objectType"])


def _listing(names: Collection[str]) -> str:
    return ", ".join(sorted(names)) or "nothing"
