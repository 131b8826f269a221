"""The files that the paper's task generator writes: per scene and task type, a list of tasks.

They lie in ``kitchens/FloorPlan1/single_search_task_metadata.json`` and so on, and hold what the
paper's test files repeat as ``task_metadata``. :func:`read_generator_tasks` and
:func:`write_generator_tasks` are inverse to each other but for the order of the tasks, which is
that of the files. What :class:`~er_gym.tasks.task.Task` has no field for travels in ``Task.extra``,
under the names of :mod:`~er_gym.tasks.paper_records`, so that such tasks can be written into a test
file. What the generator's format has no field for travels in a task's object, under ``er_gym``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import (
    Entry,
    TaskFile,
    known_scene,
    known_type,
    read_entries,
    validated,
)
from er_gym.tasks.paper_records import (
    PaperGenerated,
    as_json,
    json_kind,
    key_actions,
    metadata_record,
    own_fields,
    unknown,
    unspoken,
    with_own_fields,
)
from er_gym.tasks.reading import parse_json, read_text
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import TASK_TYPES, TaskType
from er_gym.writing import check_output, make_folder, write_output

_ENDING = "_task_metadata.json"
_SCENE = re.compile(r"FloorPlan(\d+)\w*")


def read_generator_tasks(path: str | Path) -> list[Task]:
    """Read what the paper's generator wrote.

    Args:
        path: a file, or a folder of them at any depth; other files in it are passed over.

    Returns:
        Tasks by kind of room, scene and type, with ids such as ``FloorPlan1-single_search-3`` (the
        place in the file, from 1) where the file states no other.

    Raises:
        TaskFileError: a file cannot be used, or there is none; one line says where and why.
    """
    return read_generated(path).all_or_none(Path(path))


def read_generated(path: str | Path) -> TaskFile:
    """Read what can be used of what the paper's generator wrote; see :func:`read_generator_tasks`.

    Raises:
        TaskFileError: one of the files as a whole cannot be used, or there is none.
    """
    path = Path(path)
    files = sorted(path.rglob(f"*{_ENDING}"), key=_order) if path.is_dir() else [path]
    if not files:
        raise TaskFileError(
            f"{path}: no file of the paper's generator in this folder or below; "
            f"their names end in {_ENDING}"
        )
    return read_entries(entry for file in files for entry in _entries(file, path))


def write_generator_tasks(
    folder: str | Path, tasks: Iterable[Task], *, force: bool = True
) -> list[Path]:
    """Write tasks as the paper's generator does, one file for each scene and type among them.

    Files of other names in the folder stay.

    Args:
        folder: where to; it is made where it is not there.
        tasks: what to write.
        force: whether to replace files of the same names; without it, and where one of them says
            something else, nothing is written.

    Returns:
        The files, in the order in which they are read again.

    Raises:
        TaskFileError: a task could not be read again, for what its ``extra`` says.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    groups: dict[Path, list[Task]] = {}
    for task in tasks:
        file = Path(folder, _room(task.scene), task.scene, _slug(task.type) + _ENDING)
        groups.setdefault(file, []).append(task)
    content = {
        file: as_json(file, [_record(task, file, number) for number, task in enumerate(group, 1)])
        for file, group in sorted(groups.items(), key=lambda item: _order(item[0]))
    }
    for file, data in content.items():
        if file.exists():
            check_output(file, data, force=force)
    for file, data in content.items():
        make_folder(file.parent)
        write_output(file, data, force=force)
    return list(content)


def _entries(path: Path, top: Path) -> list[Entry]:
    data = parse_json(read_text(path), path)
    if not isinstance(data, list):
        raise TaskFileError(
            f"{path}: not a list of tasks but {json_kind(data)}; "
            "the files of the paper's generator look like "
            '[{"taskname": …, "tasktype": …, "actions": …}, …]'
        )
    if any(isinstance(item, dict) and "task_metadata" in item for item in data):
        raise TaskFileError(
            f"{path}: this is a test file; read it with er_gym.tasks.paper_format.read_tasks"
        )
    name = "" if path == top else f"{path.relative_to(top)}: "

    def entry(item: object, number: int) -> Entry:
        where = f"{name}task {number}"
        return Entry(where, "", lambda: _read_task(item, path, number, where))

    return [entry(item, number) for number, item in enumerate(data, 1)]


def _read_task(data: object, path: Path, number: int, where: str) -> Task:
    paper = validated(PaperGenerated, data, where)
    scene, kind = _scene(paper.metadatapath, path, where), known_type(paper.tasktype, where)
    metadata = unknown(paper)
    if paper.metadatapath:
        metadata["metadatapath"] = paper.metadatapath
    task = Task(
        id=f"{scene}-{_slug(kind)}-{number}",
        type=kind,
        scene=scene,
        instruction=paper.taskname,
        name=paper.taskname,
        key_actions=key_actions(paper.actions, where),
        extra={
            "task_metadata": metadata,
            "actions": [unspoken(action) for action in paper.actions],
        },
    )
    return with_own_fields(task, paper.er_gym, where)


def _record(task: Task, path: Path, number: int) -> dict[str, Any]:
    record = {
        "taskname": task.name,
        "tasktype": task.type.name,
        "metadatapath": f"taskgenerate/{_room(task.scene)}/{task.scene}/metadata.json",
        **metadata_record(task),
    }
    # What a test file repeated of them need not fit the task: in one of the paper's it does not.
    record["tasktype"] = task.type.name
    record.pop("er_gym", None)
    return record | own_fields(task, _read_task(record, path, number, f"{path}: task {number}"))


def _scene(metadatapath: str, path: Path, where: str) -> str:
    """The scene of a task: some of the paper's paths name none, ``{scene}`` having stayed there."""
    folder = path.absolute().parent.name
    for name in (metadatapath, folder):
        found = _SCENE.search(name)
        with suppress(TaskFileError):
            return known_scene(found[0] if found else "", where)
    raise TaskFileError(
        f"{where} tells no scene: neither its metadatapath {metadatapath!r} nor its folder "
        f"{folder!r} names one, such as FloorPlan1"
    )


def _order(path: Path) -> tuple[float, int, str]:
    """By scene number, and so by kind of room, then by type; what is named otherwise comes last."""
    scene = _SCENE.fullmatch(path.parent.name)
    slugs = [_slug(kind) for kind in TASK_TYPES]
    slug = path.name[: -len(_ENDING)]
    return (
        int(scene[1]) if scene else float("inf"),
        slugs.index(slug) if slug in slugs else len(slugs),
        str(path),
    )


def _room(scene: str) -> str:
    """The paper's folder for a kind of room: ``living_rooms``."""
    return room_kind(scene).replace(" ", "_") + "s"


def _slug(kind: TaskType) -> str:
    return kind.name.replace(" ", "_")
