"""A first, simple task generator: from AI2-THOR object metadata to tasks of ten types.

The rules:

- What a task handles (picks up, toggles, looks for) is the only thing of its type in the scene,
  so that the instruction names one thing.
- It is *exposed* if it lies in something that does not open and that stands free: on the floor or
  on nothing; *enclosed* if it lies in something closed that stands free. Chairs and stools are not
  gone to: their boxes reach under tables, so the scenes put things into both.
- A transfer goes to a receptacle whose type accepts the thing's type; of several receptacles of
  one type it is the largest. Something that could itself be carried (a Bowl) is gone to where it
  stands.
- Within one task, a type names one receptacle: nothing goes from one CounterTop to another.

The long-range type is not generated here. Whether a task can be done is for an agent to show:
:func:`select_balanced` asks before it takes one.
"""

from __future__ import annotations

import random
import zlib
from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, cycle, islice
from typing import Any, TypeAlias

from er_gym.tasks import verbs
from er_gym.tasks.rooms import room_kind
from er_gym.tasks.task import KeyAction, Task
from er_gym.tasks.types import BY_NAME

Accepts: TypeAlias = Callable[[str, str], bool]
"""Whether a thing of the first type may be put into a receptacle of the second."""

NEVER_VISITED = frozenset({"Floor", "Toilet", "Chair", "Stool"})
"""Receptacle types that no task sends the agent to."""

WHOLES = frozenset({"Sink", "Bathtub"})
"""Receptacle types that nothing is put into: things go into their basins."""

NEVER_TOGGLED = frozenset({"StoveKnob", "StoveBurner", "LightSwitch"})

# fmt: off
HOLLOW = frozenset({
    "BathtubBasin", "Bowl", "Box", "Cabinet", "CoffeeMachine", "Cup", "Drawer", "Fridge",
    "GarbageCan", "LaundryHamper", "Microwave", "Mug", "Pan", "Pot", "Safe", "SinkBasin", "Toaster",
})
# fmt: on
"""Receptacle types that things are "in"; they are "on" the others."""

PLURAL = frozenset({"Boots"})
"""Types that are spoken of as "them"."""

UNCOUNTED = frozenset({"AluminumFoil", "Bread", "Lettuce", "TableTopDecor", "ToiletPaper"})
"""Types that, like the plural ones, take "some" where others take "a" or "an"."""


@dataclass(frozen=True)
class _Thing:
    id: str
    type: str
    parents: tuple[str, ...]
    receptacle: bool
    pickupable: bool
    openable: bool
    closed: bool
    toggleable: bool
    on: bool
    volume: float


@dataclass(frozen=True)
class _Spot:
    """Something to handle, and the receptacle that one goes to for it."""

    thing: _Thing
    place: _Thing


@dataclass(frozen=True)
class _Transfer:
    """Something to carry, the receptacle that takes it, and the one that one goes to for that."""

    source: _Spot
    target: _Thing
    place: _Thing


@dataclass(frozen=True)
class _Plan:
    """How a task is done, what it handles (its subject first), and words for its instruction."""

    key_actions: tuple[KeyAction, ...]
    handled: tuple[_Thing, ...]
    words: Mapping[str, str]


@dataclass(frozen=True)
class _Room:
    """A scene's things, sorted into what the rules speak of."""

    things: Mapping[str, _Thing]
    counts: Mapping[str, int]
    accepts: Accepts
    exposed: tuple[_Spot, ...] = ()
    enclosed: tuple[_Spot, ...] = ()

    def parents(self, thing: _Thing) -> list[_Thing]:
        return [self.things[parent] for parent in thing.parents if parent in self.things]

    def stands_free(self, thing: _Thing) -> bool:
        parents = self.parents(thing)
        return not parents or any(parent.type == "Floor" for parent in parents)


@dataclass(frozen=True)
class _Rule:
    """A row of the table of what is generated.

    Attributes:
        type: a name in ``TASK_TYPES``.
        plans: all plans of that type for a room.
        templates: instructions; the first one words the task's name.
    """

    type: str
    plans: Callable[[_Room], Iterable[_Plan]]
    templates: tuple[str, ...]


def generate_tasks(
    objects: Sequence[Mapping[str, Any]], scene: str, accepts: Accepts
) -> Iterator[Task]:
    """Yield the candidate tasks of a scene, type by type; the same for the same arguments.

    Args:
        objects: ``event.metadata["objects"]`` of the scene as it is when an episode begins.
        scene: its name, such as ``FloorPlan1``.
        accepts: whether a thing of one type may be put into a receptacle of another;
            ``er_gym.thor.accepts`` is AI2-THOR's answer.
    """
    room = _room(objects, accepts)
    for rule in _RULES:
        for plan in rule.plans(room):
            if _names_one_place_each(plan):
                yield _task(rule, plan, scene)


def select_balanced(
    candidates: Mapping[str, Iterable[Task]],
    per_type: int,
    rng: random.Random,
    solvable: Callable[[Task], bool] = lambda task: True,
) -> list[Task]:
    """Choose tasks so that types, kinds of room, scenes and objects come evenly.

    Each choice takes the kind of room chosen least for this type, in it the scene chosen least of
    all, and there the task whose words have been used least for this type; ``rng`` decides between
    equals. A task that is not ``solvable`` is passed over.

    Args:
        candidates: scene name to its candidate tasks.
        per_type: how many tasks of each type to choose; fewer where candidates run out.
        rng: the only source of chance.
        solvable: asked once for each task that would be chosen.

    Returns:
        The tasks, in the order of task types, then of scenes.
    """
    pools = {scene: list(tasks) for scene, tasks in candidates.items()}
    scene_uses: Counter[str] = Counter()
    chosen: list[Task] = []
    for task_type in BY_NAME.values():
        pool = {
            scene: rng.sample(mine, len(mine))
            for scene, tasks in pools.items()
            if (mine := [task for task in tasks if task.type == task_type])
        }
        picks = _evenly(pool, scene_uses, rng, solvable)
        chosen += sorted(islice(picks, per_type), key=_scene_number)
    return chosen


def _evenly(
    pool: dict[str, list[Task]],
    scene_uses: Counter[str],
    rng: random.Random,
    solvable: Callable[[Task], bool],
) -> Iterator[Task]:
    """Draw the tasks of one type out of ``pool`` until it is empty."""
    kind_uses: Counter[str] = Counter()
    word_uses: Counter[str] = Counter()
    while pool:
        scene = min(
            rng.sample(sorted(pool), len(pool)),
            key=lambda name: (kind_uses[room_kind(name)], scene_uses[name]),
        )
        task = min(pool[scene], key=lambda task: sum(word_uses[word] for word in _words(task)))
        pool[scene].remove(task)
        if not pool[scene]:
            del pool[scene]
        if solvable(task):
            kind_uses[room_kind(scene)] += 1
            scene_uses[scene] += 1
            word_uses.update(_words(task))
            yield task


def _words(task: Task) -> set[str]:
    """The types that a task is about."""
    return {action.object_type for action in task.key_actions if action.verb != verbs.END}


def _scene_number(task: Task) -> int:
    return int(task.scene.removeprefix("FloorPlan").removesuffix("_physics"))


# From metadata to a room.


def _room(objects: Sequence[Mapping[str, Any]], accepts: Accepts) -> _Room:
    things = {item["objectId"]: _thing(item) for item in objects}
    counts = Counter(thing.type for thing in things.values())
    bare = _Room(things, counts, accepts)
    only = [thing for thing in things.values() if counts[thing.type] == 1]
    return _Room(
        things,
        counts,
        accepts,
        exposed=tuple(spot for thing in only for spot in _exposed(bare, thing)),
        enclosed=tuple(spot for thing in only for spot in _enclosed(bare, thing)),
    )


def _thing(item: Mapping[str, Any]) -> _Thing:
    size = item["axisAlignedBoundingBox"]["size"]
    return _Thing(
        id=item["objectId"],
        type=item["objectType"],
        parents=tuple(item["parentReceptacles"] or ()),
        receptacle=item["receptacle"],
        pickupable=item["pickupable"],
        openable=item["openable"],
        closed=item["openable"] and not item["isOpen"],
        toggleable=item["toggleable"],
        on=item["isToggled"],
        volume=size["x"] * size["y"] * size["z"],
    )


def _exposed(room: _Room, thing: _Thing) -> list[_Spot]:
    """Where an exposed thing is gone to: one spot, or none."""
    parents = room.parents(thing)
    return [] if any(parent.openable for parent in parents) else _spots(room, thing, parents)


def _enclosed(room: _Room, thing: _Thing) -> list[_Spot]:
    """Where an enclosed thing is gone to: one spot, or none."""
    closed = [parent for parent in room.parents(thing) if parent.receptacle and parent.closed]
    return _spots(room, thing, closed)


def _spots(room: _Room, thing: _Thing, parents: Iterable[_Thing]) -> list[_Spot]:
    """The largest of those parents that stand free, or nothing."""
    places = [parent for parent in parents if _may_visit(parent) and room.stands_free(parent)]
    return [_Spot(thing, _largest(places))] if places else []


def _largest(things: Iterable[_Thing]) -> _Thing:
    return max(things, key=lambda thing: (thing.volume, thing.id))


def _may_visit(thing: _Thing) -> bool:
    return thing.type not in NEVER_VISITED


# Plans, type by type.


def _searches(room: _Room, hidden: bool) -> Iterator[_Plan]:
    for spot in _carried(room, hidden):
        actions = [_go(spot.place, spot.thing), *_open(spot.place)]
        yield _plan(actions, [spot.thing])


def _pickups(room: _Room, hidden: bool) -> Iterator[_Plan]:
    for spot in _carried(room, hidden):
        yield _plan(_fetch(spot), [spot.thing])


def _toggles(room: _Room) -> Iterator[_Plan]:
    for spot in room.exposed:
        thing = spot.thing
        if thing.toggleable and thing.type not in NEVER_TOGGLED:
            actions = [_go(spot.place, thing), _do(verbs.TOGGLE, thing)]
            yield _plan(actions, [thing], way="off" if thing.on else "on")


def _transfer_plans(room: _Room, hidden: bool, into_closed: bool) -> Iterator[_Plan]:
    for move in _transfers(room, hidden):
        if move.target.closed == into_closed:
            yield _plan(
                [*_fetch(move.source), *_deliver(move)],
                _handled(move),
                place=_in(move.target),
            )


def _sequences(room: _Room) -> Iterator[_Plan]:
    """Two transfers in order; each transfer comes first once, so that there are not too many."""
    moves = [*_transfers(room, hidden=False), *_transfers(room, hidden=True)]
    for index, first in enumerate(moves):
        start = index + len(moves) // 2
        partners = islice(cycle(moves), start, start + len(moves))
        plans = (_sequence(first, second) for second in partners if _independent(first, second))
        yield from islice(filter(_names_one_place_each, plans), 1)


def _sequence(first: _Transfer, second: _Transfer) -> _Plan:
    return _plan(
        [
            *_fetch(first.source),
            *_deliver(first),
            *_close(first.target),
            *_fetch(second.source),
            *_deliver(second),
        ],
        [*_handled(first), *_handled(second)],
        place=_in(first.target),
        second_object=second.source.thing.type,
        second_place=_in(second.target),
    )


def _independent(first: _Transfer, second: _Transfer) -> bool:
    """Whether things and targets all differ: neither transfer undoes or uses up the other."""
    handled = [*_handled(first), *_handled(second)]
    return first.target != second.target and len(set(handled)) == len(handled)


def _carried(room: _Room, hidden: bool) -> Iterator[_Spot]:
    return (spot for spot in (room.enclosed if hidden else room.exposed) if spot.thing.pickupable)


def _transfers(room: _Room, hidden: bool) -> Iterator[_Transfer]:
    """Every thing to carry, with one target of each receptacle type that takes it."""
    # What can be carried is gone to where it stands, unless that is the floor.
    standing_on = {spot.thing: spot.place for spot in room.exposed if spot.thing.pickupable}
    targets = [thing for thing in room.things.values() if _is_target(room, thing, standing_on)]
    largest = [_largest(group) for group in _by_type(targets)]
    for source in _carried(room, hidden):
        for target in largest:
            if room.accepts(source.thing.type, target.type) and not _is_in(source, target):
                yield _Transfer(source, target, standing_on.get(target, target))


def _is_target(room: _Room, thing: _Thing, portable: Container[_Thing]) -> bool:
    """Whether transfers may go to a thing: a receptacle that stands somewhere one can say."""
    fits = thing.receptacle and _may_visit(thing) and thing.type not in WHOLES
    return fits and (not thing.pickupable or thing in portable or room.stands_free(thing))


def _by_type(things: Iterable[_Thing]) -> Iterable[list[_Thing]]:
    groups: dict[str, list[_Thing]] = {}
    for thing in things:
        groups.setdefault(thing.type, []).append(thing)
    return groups.values()


def _is_in(source: _Spot, target: _Thing) -> bool:
    """Whether a thing is, or lies in, that target or another part of it (a Sink and its basin)."""
    holders = (source.thing.id, source.place.id, *source.thing.parents)
    return _whole(target.id) in map(_whole, holders)


def _whole(object_id: str) -> str:
    """The id of what an object is a part of: type and coordinates, without a part's name."""
    return "|".join(object_id.split("|")[:4])


def _handled(move: _Transfer) -> list[_Thing]:
    """What a transfer takes hold of or fills that one does not go to itself."""
    small = [move.target] if move.target != move.place else []
    return [move.source.thing, *small]


def _plan(actions: Sequence[KeyAction], handled: Sequence[_Thing], **words: str) -> _Plan:
    involved = dict.fromkeys(chain.from_iterable(action.related_objects for action in actions))
    end = KeyAction(verbs.END, related_objects=tuple(involved))
    return _Plan((*actions, end), tuple(handled), words)


# Key actions, as the paper's tasks have them.


def _fetch(spot: _Spot) -> list[KeyAction]:
    return [
        _go(spot.place, spot.thing),
        *_open(spot.place),
        _do(verbs.PICKUP, spot.thing),
        *_close(spot.place),
    ]


def _deliver(move: _Transfer) -> list[KeyAction]:
    return [_go(move.place, move.target), *_open(move.target), _do(verbs.PUT, move.target)]


def _go(place: _Thing, reason: _Thing) -> KeyAction:
    related = tuple(dict.fromkeys((place.id, reason.id)))
    return KeyAction(verbs.NAVIGATE, place.id, place.type, related)


def _open(place: _Thing) -> list[KeyAction]:
    return [_do(verbs.OPEN, place)] if place.closed else []


def _close(place: _Thing) -> list[KeyAction]:
    """Shut what the plan had to open."""
    return [_do(verbs.CLOSE, place)] if place.closed else []


def _do(verb: str, thing: _Thing) -> KeyAction:
    return KeyAction(verb, thing.id, thing.type, (thing.id,))


def _names_one_place_each(plan: _Plan) -> bool:
    """Whether no type stands for two objects among those that the plan acts on."""
    named = {(action.object_type, action.object_id) for action in plan.key_actions}
    return len(named) == len({object_type for object_type, _ in named})


# Words.


def _a(object_type: str) -> str:
    if object_type in UNCOUNTED | PLURAL:
        return f"some {object_type}"
    return f"{'an' if object_type[0] in 'AEIOU' else 'a'} {object_type}"


def _it(object_type: str) -> str:
    return "them" if object_type in PLURAL else "it"


def _in(receptacle: _Thing) -> str:
    return f"{'in' if receptacle.type in HOLLOW else 'on'} the {receptacle.type}"


_FIND = (
    "Find the {object} in the {room}.",
    "Can you find {an_object} anywhere in this {room}?",
    "I have lost sight of the {object}. Please look around the {room} for {it}.",
    "There should be {an_object} in this {room}. Please go and look.",
)
_PICK_UP = (
    "Pick up the {object} in the {room}.",
    "Please fetch the {object}.",
    "I need {an_object} from this {room}. Could you get hold of {it} for me?",
    "Look around the {room} until you see the {object}, and take {it} in your hand.",
)
_TOGGLE = (
    "Turn {way} the {object} in the {room}.",
    "Please switch the {object} {way}.",
    "Would you turn the {object} {way} for me?",
    "Go over to the {object} and switch {it} {way}.",
)
_MOVE = (
    "Put the {object} {place}.",
    "Please take the {object} and put {it} {place}.",
    "I would like to have the {object} {place}. Can you see to that?",
    "Could you get the {object} and leave {it} {place}?",
)
_MOVE_TWO = (
    "First, put the {object} {place}; then, put the {second_object} {second_place}.",
    "Please put the {object} {place}, and after that put the {second_object} {second_place}.",
    "Two things, in this order: the {object} goes {place}, the {second_object} {second_place}.",
    "Once you have put the {object} {place}, could you put the {second_object} {second_place}?",
)


def _transfer_rule(type_name: str, hidden: bool, into_closed: bool) -> _Rule:
    return _Rule(type_name, partial(_transfer_plans, hidden=hidden, into_closed=into_closed), _MOVE)


_RULES = (
    _Rule("single_search", partial(_searches, hidden=False), _FIND),
    _Rule("single_search_from_closerep", partial(_searches, hidden=True), _FIND),
    _Rule("single_pickup", partial(_pickups, hidden=False), _PICK_UP),
    _Rule("single_pickup_from_closerep", partial(_pickups, hidden=True), _PICK_UP),
    _Rule("single_toggle", _toggles, _TOGGLE),
    _transfer_rule("pickup_and_put", hidden=False, into_closed=False),
    _transfer_rule("pickup_and_put_in_closerep", hidden=False, into_closed=True),
    _transfer_rule("pickup_from_closerep_and_put", hidden=True, into_closed=False),
    _transfer_rule("pickup_from_closerep_and_put_in_closerep", hidden=True, into_closed=True),
    _Rule("ordered_pickup_two_object_and_put", _sequences, _MOVE_TWO),
)

GENERATED_TYPES = tuple(BY_NAME[rule.type] for rule in _RULES)
"""The task types that :func:`generate_tasks` makes."""


def _task(rule: _Rule, plan: _Plan, scene: str) -> Task:
    subjects = [
        action.object_type
        for action in plan.key_actions
        if action.verb in (verbs.PICKUP, verbs.PUT, verbs.TOGGLE)
    ] or [thing.type for thing in plan.handled]
    task_id = "-".join((scene, rule.type, *subjects))
    subject = plan.handled[0].type
    words = {
        "object": subject,
        "an_object": _a(subject),
        "it": _it(subject),
        "room": room_kind(scene),
        **plan.words,
    }
    # Not hash(): that differs from process to process.
    template = rule.templates[zlib.crc32(task_id.encode()) % len(rule.templates)]
    gone_to = [a.object_id for a in plan.key_actions if a.verb == verbs.NAVIGATE]
    return Task(
        id=task_id,
        type=BY_NAME[rule.type],
        scene=scene,
        instruction=template.format_map(words),
        name=rule.templates[0].format_map(words),
        key_actions=plan.key_actions,
        target_objects=tuple(dict.fromkeys(gone_to)),
        related_objects=tuple(thing.id for thing in plan.handled),
    )
