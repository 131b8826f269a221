"""Plans of tasks with several parts: two transfers in order, washing on the way."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle, islice
from math import hypot

from er_gym.tasks import verbs
from er_gym.tasks.generate.key_actions import close_again, deliver, do, fetch
from er_gym.tasks.generate.plan import Plan, make_plan
from er_gym.tasks.generate.room import Room, Thing, same_whole
from er_gym.tasks.generate.transport import Transfer, is_in, transfers
from er_gym.tasks.generate.words import in_the

WATER_REACH = 1.0
"""A Faucet is a basin's if their middles are so near, metres on the floor plan."""


def sequences(room: Room) -> Iterator[Plan]:
    """Two transfers in order; each transfer comes first once, so that there are not too many."""
    moves = _all_transfers(room)
    for index, first in enumerate(moves):
        start = index + len(moves) // 2
        partners = islice(cycle(moves), start, start + len(moves))
        plans = (_sequence(first, second) for second in partners if _independent(first, second))
        yield from islice((plan for plan in plans if plan.names_one_place_each), 1)


def _sequence(first: Transfer, second: Transfer) -> Plan:
    return make_plan(
        [
            *fetch(first.source),
            *deliver(first.target, first.place),
            *close_again(first.target),
            *fetch(second.source),
            *deliver(second.target, second.place),
        ],
        [*first.handled, *second.handled],
        place=in_the(first.target.type),
        second_object=second.source.thing.type,
        second_place=in_the(second.target.type),
    )


def _independent(first: Transfer, second: Transfer) -> bool:
    """Whether things and targets all differ: neither transfer undoes or uses up the other."""
    handled = [*first.handled, *second.handled]
    return first.target != second.target and len(set(handled)) == len(handled)


def washes(room: Room) -> Iterator[Plan]:
    """Transfers of things that may lie in a SinkBasin, which are washed there on the way."""
    for basin, faucet in _washing_places(room):
        for move in _all_transfers(room):
            if _may_wash(room, move, basin):
                yield _wash(move, basin, faucet)


def _washing_places(room: Room) -> list[tuple[Thing, Thing]]:
    """The SinkBasin and its Faucet, or nothing: the scene has one of each, that one can name."""
    sinks, faucets = room.of_type("SinkBasin"), room.of_type("Faucet")
    if len(sinks) != 1 or len(faucets) != 1 or faucets[0].on:
        return []
    faucet = faucets[0]

    def gap(basin: Thing) -> float:
        return hypot(basin.x - faucet.x, basin.z - faucet.z)

    # A bathtub may have the water: it runs into the nearest basin.
    nearest = min(room.of_type("SinkBasin", "BathtubBasin"), key=gap)
    return [(nearest, faucet)] if nearest == sinks[0] and gap(nearest) <= WATER_REACH else []


def _may_wash(room: Room, move: Transfer, basin: Thing) -> bool:
    """Whether a thing that may lie in the basin neither comes from there nor stays there."""
    comes = is_in(move.source, basin)
    stays = same_whole(move.place.id, basin.id)
    return room.accepts(move.source.thing.type, basin.type) and not comes and not stays


def _wash(move: Transfer, basin: Thing, faucet: Thing) -> Plan:
    return make_plan(
        [
            *fetch(move.source),
            *deliver(basin, basin),
            do(verbs.TOGGLE, faucet),
            do(verbs.PICKUP, move.source.thing),
            *deliver(move.target, move.place),
        ],
        # Not the Faucet: whoever went to the CounterTop for the thing would be led to it.
        move.handled,
        place=in_the(move.target.type),
        basin=in_the(basin.type),
        faucet=faucet.type,
    )


def _all_transfers(room: Room) -> list[Transfer]:
    return [*transfers(room, hidden=False), *transfers(room, hidden=True)]
