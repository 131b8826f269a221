"""Plans of searches: go to where a thing is, open what hides it."""

from __future__ import annotations

from collections.abc import Iterator

from er_gym.tasks.generate.key_actions import go_to, open_if_closed
from er_gym.tasks.generate.plan import Plan, make_plan
from er_gym.tasks.generate.room import Room


def searches(room: Room, hidden: bool) -> Iterator[Plan]:
    """Find each thing that can be carried."""
    for spot in room.carried(hidden):
        actions = [go_to(spot.place, spot.thing), *open_if_closed(spot.place)]
        yield make_plan(actions, [spot.thing])
