"""Fit a task to the scene as it is: real files spell some object ids differently, or wrongly."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.start import begin
from er_gym.tasks.task import Task, type_of_id
from er_gym.thor import make_controller


def _coordinates(object_id: str) -> tuple[str, ...]:
    """An id with its coordinates as numbers: ``+00.00``, ``-00.00`` and ``00.00`` are one."""

    def number(part: str) -> str:
        try:
            return f"{float(part) + 0.0:.2f}"
        except ValueError:
            return part

    return tuple(number(part) for part in object_id.split("|"))


def resolve_task(task: Task, scene_ids: Collection[str]) -> tuple[Task, list[str]]:
    """Give a task the ids that its scene has.

    Args:
        scene_ids: the object ids of the task's scene.

    Returns:
        The task with every id that is only spelled differently replaced, and a note for each id
        that was, in words.

    Raises:
        TaskFileError: a key action names an object that the scene does not have.
    """
    known = set(scene_ids)
    respelled = {_coordinates(object_id): object_id for object_id in scene_ids}
    notes: dict[str, str] = {}

    def fit(object_id: str) -> str:
        if not object_id or object_id in known:
            return object_id
        found = respelled.get(_coordinates(object_id))
        if found is None:
            return object_id
        notes[object_id] = f"task {task.id}: {object_id} is {found} in {task.scene}"
        return found

    fitted = replace(
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
        poses={fit(i): pose for i, pose in task.poses.items()},
    )
    for action in fitted.key_actions:
        if action.object_id and _to_be_there(action.object_id) not in known:
            kind = type_of_id(action.object_id)
            there = [i for i in scene_ids if type_of_id(i) == kind]
            raise TaskFileError(
                f"task {task.id}: {task.scene} has no object {action.object_id!r}; "
                + (f"its {kind} objects are: {', '.join(there)}" if there else f"it has no {kind}")
            )
    notes.update(_doubtful(task))
    return fitted, list(notes.values())


def _to_be_there(object_id: str) -> str:
    """Whose part an id names, if it is a slice: that is not there yet when the episode begins."""
    whole, _, part = object_id.rpartition("|")
    return whole if re.fullmatch(r"\w+Sliced_\d+|EggCracked", part) else object_id


def _doubtful(task: Task) -> Mapping[str, str]:
    """Key actions whose stated type is not that of their object."""
    notes = {}
    for action in task.key_actions:
        if action.object_id and action.object_type != action.actual_type:
            stated = action.object_type or "no type"
            notes[f"{action.verb} {action.object_id}"] = (
                f"task {task.id}: key action '{action.verb}' states {stated} "
                f"for {action.object_id}, a {action.actual_type}"
            )
    return notes


def resolve_tasks(tasks: Sequence[Task], backend: str = "embedded") -> tuple[list[Task], list[str]]:
    """:func:`resolve_task` for each of several tasks, in the scenes of a backend.

    Raises:
        ValueError: the backend does not have one of the scenes, cannot arrange it as a task asks,
            or there is no such backend.
        TaskFileError: as for :func:`resolve_task`.
    """
    ids: dict[tuple[str, str], list[str]] = {}
    with make_controller(backend, headless=True) as controller:
        for task in tasks:
            arrangement = (task.scene, task.start.layout)
            if arrangement not in ids:
                metadata = begin(controller, task.scene, replace(task.start, dirty=())).metadata
                ids[arrangement] = [entry["objectId"] for entry in metadata["objects"]]
    fitted, notes = [], []
    for task in tasks:
        one, said = resolve_task(task, ids[task.scene, task.start.layout])
        fitted.append(one)
        notes.extend(said)
    return fitted, notes
