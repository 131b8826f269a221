"""Match the object ids of tasks to their scenes: real files spell some ids differently or wrongly.

An id that a scene lacks usually comes from another build of AI2-THOR, in which the object has a
slightly different position. The nearest object of the same type replaces it, if it is at most
:data:`NEAR` metres away and no other object is as near. A task is set aside if an id that it needs
remains unclear, or if it needs some object of a type and the scene has none.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from math import dist, inf
from typing import Any

from er_gym.activity import begin
from er_gym.tasks.arrangement import Arrangement, set_up_scene
from er_gym.tasks.errors import SetAsideTask, Substitution, TaskFileError
from er_gym.tasks.judge import search_targets
from er_gym.tasks.task import Task, type_of_id
from er_gym.thor import make_controller
from er_gym.thor.object_types import OBJECT_TYPES

NEAR = 0.25
"""The largest distance between a missing object and its substitute, metres."""
_ROUNDED = 0.01
"""Ids state coordinates to a hundredth of a metre."""
_NUMBER = re.compile(r"[+-]?\d+\.\d+")
_NOT_THERE_YET = re.compile(r"(.*)(\|(?:\w+Sliced_\d+|EggCracked(?:_0)?))")

Position = tuple[float, float, float]
"""x, y and z in AI2-THOR's world frame, metres."""


@dataclass(frozen=True)
class ResolvedTasks:
    """The result of :func:`resolve_tasks`.

    Attributes:
        tasks: the tasks that can be played, in their order, with the ids of their scenes.
        substitutions: the objects that replace objects that the scenes lack.
        notes: other oddities of these tasks, one sentence each.
        set_aside: the tasks that cannot be played, and why.
    """

    tasks: tuple[Task, ...]
    substitutions: tuple[Substitution, ...] = ()
    notes: tuple[str, ...] = ()
    set_aside: tuple[SetAsideTask, ...] = ()


def resolve_task(
    task: Task, objects: Mapping[str, Position] | Collection[str]
) -> tuple[Task, list[Substitution], list[str]]:
    """Replace the object ids of a task by those of its scene.

    Args:
        task: the task.
        objects: the ids of all objects of the scene when the episode begins; a mapping also gives
            their positions (x, y, z in metres, AI2-THOR's world frame).

    Returns:
        The task with the scene's ids, the substitutions, and notes. There is a note for each id
        that was only spelled differently, for each missing id that no key action needs, and for
        each key action that states another type than its object has.

    Raises:
        TaskFileError: the scene lacks an object of a key action, of the goal or of the arrangement,
            and no object, or several, could replace it; or it lacks a type that the task needs.
    """
    try:
        return _resolve(task, objects)
    except TaskFileError as error:
        raise TaskFileError(f"task {task.id}: {error}") from None


def resolve_tasks(
    tasks: Iterable[Task], backend: str = "embedded", *, arrange: bool = True
) -> ResolvedTasks:
    """Apply :func:`resolve_task` to tasks, in the scenes of a backend.

    Args:
        tasks: the tasks.
        backend: a name that :func:`~er_gym.thor.make_controller` knows.
        arrange: whether to set up every arrangement on the backend. Otherwise ids are resolved from
            the poses of an arrangement, which is quicker, and the backend sets up only the
            arrangements for which this is not conclusive.

    Raises:
        BackendError: the backend cannot be started.
        ValueError: there is no such backend.
    """
    tasks = list(tasks)
    fitted, substitutions, notes, set_aside = [], [], [], []
    with make_controller(backend, headless=True) as controller:
        scenes = _Scenes(controller, len({task.scene for task in tasks}))
        for task in tasks:
            try:
                task, renamed = _with_known_names(task, scenes.names(task.scene))
                if arrange or not _contains_all(task, scenes):
                    task, near, remarks = _resolve(task, scenes.objects(task))
                    substitutions += near
                    notes += remarks
            except ValueError as error:  # a TaskFileError, or an engine that cannot arrange it
                set_aside.append(SetAsideTask(task.id, " ".join(str(error).split())))
                continue
            substitutions += renamed
            fitted.append(task)
    return ResolvedTasks(tuple(fitted), tuple(substitutions), tuple(notes), tuple(set_aside))


class _Scenes:
    """The objects of scenes and of their arrangements, each asked of the backend once."""

    def __init__(self, controller: Any, count: int) -> None:
        self._controller, self._count = controller, count
        self._recorded: dict[str, list[dict[str, Any]]] = {}
        self._arranged: dict[tuple[str, str], dict[str, Position]] = {}

    def recorded(self, scene: str) -> list[dict[str, Any]]:
        """The object metadata of a scene as recorded."""
        if scene not in self._recorded:
            begin(f"fitting the tasks to their rooms: {len(self._recorded) + 1} of {self._count}")
            self._recorded[scene] = set_up_scene(self._controller, scene, Arrangement()).metadata[
                "objects"
            ]
        return self._recorded[scene]

    def names(self, scene: str) -> Mapping[str, str]:
        """Object name to id, in a scene as recorded."""
        return {entry["name"]: entry["objectId"] for entry in self.recorded(scene)}

    def objects(self, task: Task) -> Mapping[str, Position]:
        """Object id to position when the task's episode begins."""
        key = (task.scene, task.arrangement.layout)
        if key not in self._arranged:
            if task.arrangement.poses:
                arrangement = replace(task.arrangement, dirty=())
                metadata = set_up_scene(self._controller, task.scene, arrangement).metadata
                entries = metadata["objects"]
            else:
                entries = self.recorded(task.scene)
            self._arranged[key] = {entry["objectId"]: _position_of(entry) for entry in entries}
        return self._arranged[key]


def _position_of(entry: Mapping[str, Any]) -> Position:
    at = entry["position"]
    return at["x"], at["y"], at["z"]


# -- one task --------------------------------------------------------------------------------------


def _resolve(
    task: Task, objects: Mapping[str, Position] | Collection[str]
) -> tuple[Task, list[Substitution], list[str]]:
    positions = objects if isinstance(objects, Mapping) else {}
    respelled, missing = _find_respelled(task, objects)
    there = {respelled.get(i, i) for i in _mentioned_ids(task)}.difference(missing)
    found = _find_nearest(missing, [i for i in objects if i not in there], positions)
    for object_id in _required_ids(task):
        whole = _whole_of_slice(object_id)
        if whole in missing and whole not in found:
            gone = there | {other for other, _ in found.values()}
            raise TaskFileError(_missing_message(whole, task.scene, objects, gone, positions))
    lacking = _lacking_type(task, objects)
    if lacking:
        raise TaskFileError(lacking)
    instead = {**respelled, **{named: other for named, (other, _) in found.items()}}
    notes = [
        f"task {task.id}: {named} is {other} in {task.scene}" for named, other in respelled.items()
    ]
    substitutions = [
        Substitution(task.id, task.scene, named, other, metres)
        for named, (other, metres) in found.items()
    ]
    notes += [
        f"task {task.id}: {task.scene} has no {named}; no key action is about it"
        for named in missing
        if named not in found
    ]
    return _with_ids(task, instead), substitutions, [*notes, *_type_mismatches(task)]


def _required_ids(task: Task) -> Iterator[str]:
    """The ids that a task needs; "" where a key action or condition states none."""
    yield from (action.object_id for action in task.key_actions)
    yield from (condition.object_id for condition in task.goal)
    yield from task.arrangement.dirty


def _all_ids(task: Task) -> Iterator[str]:
    """Every object id in a task. Those of its poses may come from another build."""
    yield from _mentioned_ids(task)
    yield from task.poses


def _mentioned_ids(task: Task) -> Iterator[str]:
    """Every object id in a task except those of its poses."""
    yield from filter(None, _required_ids(task))
    for action in task.key_actions:
        yield from action.related_objects
    yield from task.target_objects
    yield from task.related_objects


def _with_ids(task: Task, instead: Mapping[str, str]) -> Task:
    """The task with its ids replaced as ``instead`` says."""

    def fit(object_id: str) -> str:
        whole = _whole_of_slice(object_id)
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
        # The pose that the file states for the object itself wins.
        poses={fit(i): task.poses[i] for i in sorted(task.poses, key=lambda i: fit(i) == i)},
    )


def _lacking_type(task: Task, objects: Iterable[str]) -> str:
    """Which type of thing a task needs and its scene lacks, in words; "" if there is none.

    Where a task names a type and no id, any object of the type will do, but one there must be.
    """
    there = {type_of_id(i) for i in objects}
    there |= {f"{kind}Sliced" for kind in there} | {f"{kind}Cracked" for kind in there}
    wanted = [key.object_type for key in task.key_actions if key.scored and not key.object_id]
    wanted += [one.object_type for one in task.goal if not one.object_id]
    wanted += [one.inside for one in task.goal]
    searched = sorted(search_targets(task) - {""})
    if not there.intersection(searched):
        wanted += searched[:1]
    for kind in dict.fromkeys(filter(None, wanted)):
        if kind not in there:
            return f"{task.scene} has no {kind}{_other_spelling(kind)}"
    return ""


def _other_spelling(kind: str) -> str:
    """What else may have been meant by a type that AI2-THOR does not have."""
    if kind in OBJECT_TYPES:
        return ""
    near = get_close_matches(kind, OBJECT_TYPES, n=3)
    hint = f"; did you mean {' or '.join(near)}?" if near else ""
    return f", and there is no such type of object{hint}"


def _whole_of_slice(object_id: str) -> str:
    """The id of the whole for the id of a slice, which does not exist yet; else the same id."""
    part = _NOT_THERE_YET.fullmatch(object_id)
    return part[1] if part else object_id


def _type_mismatches(task: Task) -> list[str]:
    """A note for each key action whose stated type is not the type of its object."""
    return [
        f"task {task.id}: key action '{action.verb}' states {action.object_type or 'no type'} "
        f"for {action.object_id}, a {action.actual_type}"
        for action in dict.fromkeys(task.key_actions)
        if action.object_id and action.object_type != action.actual_type
    ]


# -- ids -------------------------------------------------------------------------------------------


def _find_respelled(task: Task, objects: Collection[str]) -> tuple[dict[str, str], list[str]]:
    """The ids that the scene spells differently, with its spelling, and the ids that it lacks."""
    unknown = [
        object_id
        for object_id in dict.fromkeys(map(_whole_of_slice, _all_ids(task)))
        if object_id not in objects
    ]
    spelled = {_coordinates(object_id): object_id for object_id in objects} if unknown else {}
    others = {object_id: spelled.get(_coordinates(object_id)) for object_id in unknown}
    respelled = {object_id: other for object_id, other in others.items() if other is not None}
    return respelled, [object_id for object_id, other in others.items() if other is None]


def _coordinates(object_id: str) -> tuple[str, ...]:
    """An id with normalised coordinates: ``+00.00``, ``-00.00`` and ``00.00`` become equal."""
    return tuple(
        f"{float(part) + 0.0:.2f}" if _NUMBER.fullmatch(part) else part
        for part in object_id.split("|")
    )


def _position_in_id(object_id: str) -> Position | None:
    """The position in an object id, metres; None if the id has none."""
    parts = object_id.split("|")[1:4]
    if len(parts) < 3 or not all(map(_NUMBER.fullmatch, parts)):
        return None
    x, y, z = map(float, parts)
    return x, y, z


def _distances(
    object_id: str, candidates: Iterable[str], positions: Mapping[str, Position]
) -> list[tuple[float, str]]:
    """The candidates of an id's type with their distances in metres, the nearest first.

    The distance is to the position in the candidate's id or to its actual position, whichever is
    smaller: an object that settled or was moved keeps the id of its former position.
    """
    place, kind = _position_in_id(object_id), type_of_id(object_id)
    found = []
    for other in candidates:
        if type_of_id(other) == kind:
            places = filter(None, (_position_in_id(other), positions.get(other)))
            found.append(
                (min((dist(place, p) for p in places), default=inf) if place else inf, other)
            )
    return sorted((round(metres, 4), other) for metres, other in found)


def _find_nearest(
    missing: Sequence[str], candidates: Sequence[str], positions: Mapping[str, Position]
) -> dict[str, tuple[str, float]]:
    """Missing id to its substitute and their distance, metres; no object is used twice."""
    near = {named: _distances(named, candidates, positions) for named in missing}
    pairs = sorted((metres, named, other) for named in near for metres, other in near[named])
    found: dict[str, tuple[str, float]] = {}
    unclear: set[str] = set()
    gone: set[str] = set()
    for metres, named, other in pairs:
        if metres > NEAR or named in found or named in unclear or other in gone:
            continue
        others = [far for far, one in near[named] if one not in gone and one != other]
        if min(others, default=inf) < metres + _ROUNDED / 2:  # as near, to the precision of ids
            unclear.add(named)
        else:
            found[named] = (other, metres)
            gone.add(other)
    return found


def _missing_message(
    object_id: str,
    scene: str,
    objects: Collection[str],
    gone: Collection[str],
    positions: Mapping[str, Position],
) -> str:
    """Why no object replaces an id; the task uses those that are ``gone`` already."""
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


# -- arrangements ----------------------------------------------------------------------------------


def _with_known_names(task: Task, names: Mapping[str, str]) -> tuple[Task, list[Substitution]]:
    """The task with the scene's names in its arrangement: name suffixes differ between builds."""
    poses = task.arrangement.poses
    substitutions = []
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
            substitutions.append(Substitution(task.id, task.scene, name, alike[0], None))
    if not instead:
        return task, []
    moved = {instead.get(name, name): pose for name, pose in poses.items()}
    return replace(task, arrangement=replace(task.arrangement, poses=moved)), substitutions


def _stem(name: str) -> str:
    return name.rpartition("_")[0]


def _contains_all(task: Task, scenes: _Scenes) -> bool:
    """Whether the poses alone show that the scene has every object of a task.

    They do if each object was not moved, or was moved to the position in its id.
    """
    poses = task.arrangement.poses
    still = {object_id for name, object_id in scenes.names(task.scene).items() if name not in poses}
    kinds = {name: type_of_id(object_id) for name, object_id in scenes.names(task.scene).items()}

    def moved_there(object_id: str) -> bool:
        place, kind = _position_in_id(object_id), type_of_id(object_id)
        return place is not None and any(
            kinds[name] == kind and dist(place, (pose.x, pose.y, pose.z)) < _ROUNDED
            for name, pose in poses.items()
        )

    if _lacking_type(task, scenes.names(task.scene).values()):
        return False
    return all(i in still or moved_there(i) for i in map(_whole_of_slice, _all_ids(task)))
