"""Key actions, as the paper's tasks have them."""

from __future__ import annotations

from er_gym.tasks import verbs
from er_gym.tasks.generate.room import Spot, Thing
from er_gym.tasks.task import KeyAction


def go_to(place: Thing, reason: Thing) -> KeyAction:
    """Go to a receptacle because of what is in it, or to a thing itself."""
    related = tuple(dict.fromkeys((place.id, reason.id)))
    return KeyAction(verbs.NAVIGATE, place.id, place.type, related)


def do(verb: str, thing: Thing) -> KeyAction:
    """Do to a thing what a verb says."""
    return KeyAction(verb, thing.id, thing.type, (thing.id,))


def open_if_closed(place: Thing) -> list[KeyAction]:
    """Open what is closed when the episode begins."""
    return [do(verbs.OPEN, place)] if place.closed else []


def close_again(place: Thing) -> list[KeyAction]:
    """Shut what the plan had to open."""
    return [do(verbs.CLOSE, place)] if place.closed else []


def fetch(spot: Spot) -> list[KeyAction]:
    """Go to where a thing is and take it, leaving the place as it was."""
    return [
        go_to(spot.place, spot.thing),
        *open_if_closed(spot.place),
        do(verbs.PICKUP, spot.thing),
        *close_again(spot.place),
    ]


def deliver(target: Thing, place: Thing) -> list[KeyAction]:
    """Put what is in the hand into a target, going to the place where that is."""
    return [go_to(place, target), *open_if_closed(target), do(verbs.PUT, target)]
