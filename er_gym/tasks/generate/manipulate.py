"""Plans of doing something to one thing where it is: take it, switch it."""

from __future__ import annotations

from collections.abc import Iterator

from er_gym.tasks import verbs
from er_gym.tasks.generate.key_actions import do, fetch, go_to
from er_gym.tasks.generate.plan import Plan, make_plan
from er_gym.tasks.generate.room import Room

NEVER_TOGGLED = frozenset({"StoveKnob", "StoveBurner", "LightSwitch"})


def pickups(room: Room, hidden: bool) -> Iterator[Plan]:
    """Take each thing that can be carried."""
    for spot in room.carried(hidden):
        yield make_plan(fetch(spot), [spot.thing])


def toggles(room: Room) -> Iterator[Plan]:
    """Switch each exposed thing that has a switch."""
    for spot in room.exposed:
        thing = spot.thing
        if thing.toggleable and thing.type not in NEVER_TOGGLED:
            actions = [go_to(spot.place, thing), do(verbs.TOGGLE, thing)]
            yield make_plan(actions, [thing], way="off" if thing.on else "on")
