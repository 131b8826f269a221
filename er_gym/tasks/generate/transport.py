"""Transfers: fetch a thing, put it somewhere else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from er_gym.tasks.generate.scene_graph import Room, Thing, largest, may_fill
from er_gym.tasks.generate.script import Script
from er_gym.tasks.generate.task_plan import Plan, Row, from_templates, plan_of
from er_gym.tasks.generate.templates import MOVE
from er_gym.tasks.generate.words import in_the


def transfer(room: Room, thing: Thing, target: Thing) -> Plan:
    """Fetch a thing and put it into a target."""
    script = Script(room)
    script.fetch(thing)
    script.put(target)
    return plan_of(script, thing, place=in_the(target.type))


def transfers(room: Room, hidden: bool) -> Iterator[tuple[Thing, Thing]]:
    """Every exposed or enclosed thing, with one target of each receptacle type that takes it."""
    targets = [target for group in _by_type(room) if (target := _target_of(room, group))]
    for thing in room.carried(hidden):
        for target in targets:
            if room.accepts(thing.type, target.type) and not room.is_in(thing, target):
                yield thing, target


def _target_of(room: Room, group: list[Thing]) -> Thing | None:
    """The largest of some receptacles of one type, if a transfer may go there.

    None may be open where another is shut: the words do not say which.
    """
    alike = len({thing.closed for thing in group}) == 1
    fit = [thing for thing in group if _is_target(room, thing)]
    return largest(fit) if fit and alike else None


def _is_target(room: Room, thing: Thing) -> bool:
    """Whether transfers may go to a thing: a receptacle that stands somewhere one can say.

    What can be carried is gone to where it stands, unless that is the floor.
    """
    return (thing.receptacle and may_fill(thing)) and (
        not thing.pickupable or room.is_exposed(thing) or room.stands_free(thing)
    )


def _by_type(room: Room) -> Iterable[list[Thing]]:
    groups: dict[str, list[Thing]] = {}
    for thing in room.things.values():
        groups.setdefault(thing.type, []).append(thing)
    return groups.values()


def _moves(room: Room, hidden: bool, into_closed: bool) -> Iterator[tuple[Thing, Thing]]:
    return (move for move in transfers(room, hidden) if move[1].closed == into_closed)


ROWS = tuple(
    Row(
        name,
        choices=partial(_moves, hidden=hidden, into_closed=into_closed),
        plan=transfer,
        sayings=from_templates(MOVE),
    )
    for name, hidden, into_closed in (
        ("pickup_and_put", False, False),
        ("pickup_and_put_in_closerep", False, True),
        ("pickup_from_closerep_and_put", True, False),
        ("pickup_from_closerep_and_put_in_closerep", True, True),
    )
)
