"""Fit tasks to their scenes: real files spell some object ids differently, or wrongly.

An id that a scene lacks is mostly one of another build of AI2-THOR, where the object stands a
little elsewhere. So the nearest object of its type, at most :data:`NEAR` metres off, is taken for
it, if no other comes into question. A task that this leaves in doubt is set aside.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import dist, inf
from typing import Any

from er_gym.tasks.arrangement import Arrangement, set_up_scene
from er_gym.tasks.errors import SetAside, Taken, TaskFileError
from er_gym.tasks.task import Task, type_of_id
from er_gym.thor import make_controller

NEAR = 0.25
"""How far off an object may be that is taken for one that is missing, metres."""
_ROUNDED = 0.01
"""Ids tell places to a hundredth of a metre."""
_NUMBER = re.compile(r"[+-]?\d+\.\d+")
_NOT_THERE_YET = re.compile(r"(.*)(\|(?:\w+Sliced_\d+|EggCracked(?:_0)?))")

Position = tuple[float, float, float]
"""x, y and z in AI2-THOR's world frame, metres."""


@dataclass(frozen=True)
class Fitted:
    """What came of fitting tasks to their scenes.

    Attributes:
        tasks: those that can be played, in their order, with the ids that their scenes have.
        taken: what stands for objects that the scenes lack.
        notes: what else is odd about them, in words.
        set_aside: the others, and why.
    """

    tasks: tuple[Task, ...]
    taken: tuple[Taken, ...] = ()
    notes: tuple[str, ...] = ()
    set_aside: tuple[SetAside, ...] = ()


def resolve_task(
    task: Task, objects: Mapping[str, Position] | Collection[str]
) -> tuple[Task, list[Taken], list[str]]:
    """Give a task the ids that its scene has.

    Args:
        objects: the ids of the objects of the task's scene as it is arranged when the task begins,
            with their positions where these are known.

    Returns:
        The task with every id that is spelled differently, or that is off a little, replaced; what
        was taken for what; and notes in words on ids that were respelled and on doubtful types.

    Raises:
        TaskFileError: a key action, the goal or the start is about an object that the scene lacks,
            and none, or several, could be meant.
    """
    try:
        return _resolve(task, objects)
    except TaskFileError as error:
        raise TaskFileError(f"task {task.id}: {error}") from None


def resolve_tasks(
    tasks: Iterable[Task], backend: str = "embedded", *, arrange: bool = True
) -> Fitted:
    """:func:`resolve_task` for each of several tasks, in the scenes of a backend.

    Args:
        arrange: make each arrangement of a scene to see what is in it; else this is told from the
            poses of the arrangement, which is quicker, and only what that leaves open is made.

    Raises:
        BackendError: the backend cannot be started.
        ValueError: there is no such backend.
    """
    fitted, taken, notes, set_aside = [], [], [], []
    with make_controller(backend, headless=True) as controller:
        rooms = _Rooms(controller)
        for task in tasks:
            try:
                task, renamed = _with_names(task, rooms.names(task.scene))
                if arrange or not _all_there(task, rooms):
                    task, near, said = _resolve(task, rooms.objects(task))
                    taken += near
                    notes += said
            except ValueError as error:  # a TaskFileError, or an engine that cannot arrange it
                set_aside.append(SetAside(task.id, " ".join(str(error).split())))
                continue
            taken += renamed
            fitted.append(task)
    return Fitted(tuple(fitted), tuple(taken), tuple(notes), tuple(set_aside))


class _Rooms:
    """What is in scenes and arrangements of them, found out once."""

    def __init__(self, controller: Any) -> None:
        self._controller = controller
        self._recorded: dict[str, list[dict[str, Any]]] = {}
        self._arranged: dict[tuple[str, str], dict[str, Position]] = {}

    def recorded(self, scene: str) -> list[dict[str, Any]]:
        """Metadata of a scene's objects as they are recorded."""
        if scene not in self._recorded:
            self._recorded[scene] = set_up_scene(self._controller, scene, Arrangement()).metadata[
                "objects"
            ]
        return self._recorded[scene]

    def names(self, scene: str) -> Mapping[str, str]:
        """Name to id, in a scene as it is recorded."""
        return {entry["name"]: entry["objectId"] for entry in self.recorded(scene)}

    def objects(self, task: Task) -> Mapping[str, Position]:
        """Id to position, as the task begins."""
        key = (task.scene, task.arrangement.layout)
        if key not in self._arranged:
            if task.arrangement.poses:
                arrangement = replace(task.arrangement, dirty=())
                metadata = set_up_scene(self._controller, task.scene, arrangement).metadata
                entries = metadata["objects"]
            else:
                entries = self.recorded(task.scene)
            self._arranged[key] = {entry["objectId"]: _position(entry) for entry in entries}
        return self._arranged[key]


def _position(entry: Mapping[str, Any]) -> Position:
    at = entry["position"]
    return at["x"], at["y"], at["z"]


# -- one task --------------------------------------------------------------------------------------


def _resolve(
    task: Task, objects: Mapping[str, Position] | Collection[str]
) -> tuple[Task, list[Taken], list[str]]:
    positions = objects if isinstance(objects, Mapping) else {}
    respelled, missing = _respelled(task, objects)
    there = {respelled.get(i, i) for i in _named(task)}.difference(missing)
    found = _nearest(missing, [i for i in objects if i not in there], positions)
    for object_id in _essential(task):
        whole = _to_be_there(object_id)
        if whole in missing and whole not in found:
            gone = there | {other for other, _ in found.values()}
            raise TaskFileError(_lacking(whole, task.scene, objects, gone, positions))
    instead = {**respelled, **{named: other for named, (other, _) in found.items()}}
    notes = [
        f"task {task.id}: {named} is {other} in {task.scene}" for named, other in respelled.items()
    ]
    taken = [
        Taken(task.id, task.scene, named, other, metres) for named, (other, metres) in found.items()
    ]
    notes += [
        f"task {task.id}: {task.scene} has no {named}; no key action is about it"
        for named in missing
        if named not in found
    ]
    return _with_ids(task, instead), taken, [*notes, *_doubtful(task)]


def _essential(task: Task) -> Iterator[str]:
    """The ids without which a task cannot be done; "" where none is stated."""
    yield from (action.object_id for action in task.key_actions)
    yield from (condition.object_id for condition in task.goal)
    yield from task.arrangement.dirty


def _ids(task: Task) -> Iterator[str]:
    """Every object id in a task, those of its poses too: they may be of another build than it."""
    yield from _named(task)
    yield from task.poses


def _named(task: Task) -> Iterator[str]:
    """The ids of what a task is about."""
    yield from filter(None, _essential(task))
    for action in task.key_actions:
        yield from action.related_objects
    yield from task.target_objects
    yield from task.related_objects


def _with_ids(task: Task, instead: Mapping[str, str]) -> Task:
    """The task with some ids replaced by others."""

    def fit(object_id: str) -> str:
        whole = _to_be_there(object_id)
        return instead.get(whole, whole) + object_id[len(whole) :]

    return replace(
        task,
        key_actions=tuple(
            replace(
                action,
                object_id=fit(action.object_id),
                related_objects=tuple(fit(r) for r in action.related_objects),
            )
            for action in task.key_actions
        ),
        target_objects=tuple(fit(i) for i in task.target_objects),
        related_objects=tuple(fit(i) for i in task.related_objects),
        goal=tuple(replace(one, object_id=fit(one.object_id)) for one in task.goal),
        arrangement=replace(task.arrangement, dirty=tuple(fit(i) for i in task.arrangement.dirty)),
        # What is stated for the object itself counts before what is stated for another.
        poses={fit(i): task.poses[i] for i in sorted(task.poses, key=lambda i: fit(i) == i)},
    )


def _to_be_there(object_id: str) -> str:
    """Whose part an id names, if it is a slice: that is not there yet when the episode begins."""
    part = _NOT_THERE_YET.fullmatch(object_id)
    return part[1] if part else object_id


def _doubtful(task: Task) -> list[str]:
    """Key actions whose stated type is not that of their object."""
    return [
        f"task {task.id}: key action '{action.verb}' states {action.object_type or 'no type'} "
        f"for {action.object_id}, a {action.actual_type}"
        for action in dict.fromkeys(task.key_actions)
        if action.object_id and action.object_type != action.actual_type
    ]


# -- ids -------------------------------------------------------------------------------------------


def _respelled(task: Task, objects: Collection[str]) -> tuple[dict[str, str], list[str]]:
    """The ids of a task that its scene only spells differently, and those that it lacks."""
    spelled = {_coordinates(object_id): object_id for object_id in objects}
    respelled, missing = {}, []
    for object_id in dict.fromkeys(map(_to_be_there, _ids(task))):
        if object_id not in objects:
            other = spelled.get(_coordinates(object_id))
            if other is None:
                missing.append(object_id)
            else:
                respelled[object_id] = other
    return respelled, missing


def _coordinates(object_id: str) -> tuple[str, ...]:
    """An id with its coordinates as numbers: ``+00.00``, ``-00.00`` and ``00.00`` are one."""
    return tuple(
        f"{float(part) + 0.0:.2f}" if _NUMBER.fullmatch(part) else part
        for part in object_id.split("|")
    )


def _place(object_id: str) -> Position | None:
    """The position that an id tells, metres."""
    parts = object_id.split("|")[1:4]
    if len(parts) < 3 or not all(map(_NUMBER.fullmatch, parts)):
        return None
    x, y, z = map(float, parts)
    return x, y, z


def _distances(
    object_id: str, candidates: Iterable[str], positions: Mapping[str, Position]
) -> list[tuple[float, str]]:
    """How far off the candidates of an id's type are, metres, the nearest first.

    An object is where its id says or where it is, whichever is nearer: what has come to rest, or
    has been moved, is not where it was named after.
    """
    place, kind = _place(object_id), type_of_id(object_id)
    found = []
    for other in candidates:
        if type_of_id(other) == kind:
            places = filter(None, (_place(other), positions.get(other)))
            found.append(
                (min((dist(place, p) for p in places), default=inf) if place else inf, other)
            )
    return sorted((round(metres, 4), other) for metres, other in found)


def _nearest(
    missing: Sequence[str], candidates: Sequence[str], positions: Mapping[str, Position]
) -> dict[str, tuple[str, float]]:
    """Missing id to what is taken for it and how far off that is, metres; each is taken once."""
    near = {named: _distances(named, candidates, positions) for named in missing}
    pairs = sorted((metres, named, other) for named in near for metres, other in near[named])
    found: dict[str, tuple[str, float]] = {}
    unclear: set[str] = set()
    gone: set[str] = set()
    for metres, named, other in pairs:
        if metres > NEAR or named in found or named in unclear or other in gone:
            continue
        others = [far for far, one in near[named] if one not in gone and one != other]
        if min(others, default=inf) < metres + _ROUNDED / 2:  # as near, as far as ids tell
            unclear.add(named)
        else:
            found[named] = (other, metres)
            gone.add(other)
    return found


def _lacking(
    object_id: str,
    scene: str,
    objects: Collection[str],
    gone: Collection[str],
    positions: Mapping[str, Position],
) -> str:
    """Why nothing is taken for an id; of the objects some are ``gone``, the task's already."""
    kind = type_of_id(object_id)
    near = _distances(object_id, [i for i in objects if i not in gone], positions)
    told = [f"{one}, {metres:.2f} m off" if metres < inf else one for metres, one in near[:2]]
    if not near:
        why = f"it has no {'other ' if any(type_of_id(i) == kind for i in gone) else ''}{kind}"
    elif near[0][0] > NEAR:
        why = f"the nearest {kind} is {told[0]}" if near[0][0] < inf else f"it has {told[0]}"
    else:
        why = f"it could be {' or '.join(told)}"
    return f"{scene} has no object {object_id!r}; {why}"


# -- starts ----------------------------------------------------------------------------------------


def _with_names(task: Task, names: Mapping[str, str]) -> tuple[Task, list[Taken]]:
    """The task with a start that moves what the scene has: names end in what differs by build."""
    poses = task.arrangement.poses
    taken = []
    instead: dict[str, str] = {}
    for name in poses:
        if name not in names:
            alike = [n for n in names if _stem(n) == _stem(name) and n not in poses]
            if len(alike) != 1 or alike[0] in instead.values():
                raise TaskFileError(
                    f"its arrangement moves {name!r}, which {task.scene} does not have; "
                    + (f"it could be {' or '.join(alike)}" if alike else "nor any of that name")
                )
            instead[name] = alike[0]
            taken.append(Taken(task.id, task.scene, name, alike[0], None))
    if not instead:
        return task, []
    moved = {instead.get(name, name): pose for name, pose in poses.items()}
    return replace(task, arrangement=replace(task.arrangement, poses=moved)), taken


def _stem(name: str) -> str:
    return name.rpartition("_")[0]


def _all_there(task: Task, rooms: _Rooms) -> bool:
    """Whether a scene has all that a task names, as far as that can be told without arranging it:
    what is as recorded, and what has been moved to where its id says."""
    poses = task.arrangement.poses
    still = {object_id for name, object_id in rooms.names(task.scene).items() if name not in poses}
    kinds = {name: type_of_id(object_id) for name, object_id in rooms.names(task.scene).items()}

    def moved_there(object_id: str) -> bool:
        place, kind = _place(object_id), type_of_id(object_id)
        return place is not None and any(
            kinds[name] == kind and dist(place, (pose.x, pose.y, pose.z)) < _ROUNDED
            for name, pose in poses.items()
        )

    return all(i in still or moved_there(i) for i in map(_to_be_there, _ids(task)))
