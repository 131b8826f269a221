"""Plans of transfers: fetch a thing, put it somewhere else."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass

from er_gym.tasks.generate.key_actions import deliver, fetch
from er_gym.tasks.generate.plan import Plan, make_plan
from er_gym.tasks.generate.room import Room, Spot, Thing, largest, may_visit, same_whole
from er_gym.tasks.generate.words import in_the

WHOLES = frozenset({"Sink", "Bathtub"})
"""Receptacle types that nothing is put into: things go into their basins."""


@dataclass(frozen=True)
class Transfer:
    """Something to carry, the receptacle that takes it, and the one that one goes to for that."""

    source: Spot
    target: Thing
    place: Thing

    @property
    def handled(self) -> tuple[Thing, ...]:
        """What it takes hold of or fills that one does not go to itself."""
        small = (self.target,) if self.target != self.place else ()
        return (self.source.thing, *small)


def transfer_plans(room: Room, hidden: bool, into_closed: bool) -> Iterator[Plan]:
    """Every transfer of an enclosed or exposed thing to a closed target or another one."""
    for move in transfers(room, hidden):
        if move.target.closed == into_closed:
            yield make_plan(
                [*fetch(move.source), *deliver(move.target, move.place)],
                move.handled,
                place=in_the(move.target.type),
            )


def transfers(room: Room, hidden: bool) -> Iterator[Transfer]:
    """Every thing to carry, with one target of each receptacle type that takes it."""
    # What can be carried is gone to where it stands, unless that is the floor.
    standing_on = {spot.thing: spot.place for spot in room.carried(hidden=False)}
    targets = [thing for thing in room.things.values() if _is_target(room, thing, standing_on)]
    largest_ones = [largest(group) for group in _by_type(targets)]
    for source in room.carried(hidden):
        for target in largest_ones:
            if room.accepts(source.thing.type, target.type) and not is_in(source, target):
                yield Transfer(source, target, standing_on.get(target, target))


def _is_target(room: Room, thing: Thing, portable: Container[Thing]) -> bool:
    """Whether transfers may go to a thing: a receptacle that stands somewhere one can say."""
    fits = thing.receptacle and may_visit(thing) and thing.type not in WHOLES
    return fits and (not thing.pickupable or thing in portable or room.stands_free(thing))


def _by_type(things: Iterable[Thing]) -> Iterable[list[Thing]]:
    groups: dict[str, list[Thing]] = {}
    for thing in things:
        groups.setdefault(thing.type, []).append(thing)
    return groups.values()


def is_in(source: Spot, target: Thing) -> bool:
    """Whether a thing is, or lies in, that target or another part of it (a Sink and its basin)."""
    holders = (source.thing.id, source.place.id, *source.thing.parents)
    return any(same_whole(target.id, holder) for holder in holders)
