"""The files of the paper's task generator: a list of tasks for each scene and task type.

A path is ``kitchens/FloorPlan1/single_search_task_metadata.json``, for example. The paper's test
files repeat a task of these files as ``task_metadata``. :func:`read_generator_tasks` and
:func:`write_generator_tasks` are inverse to each other, except that tasks come in the order of the
files. ``Task.extra`` keeps the fields for which :class:`~er_gym.tasks.task.Task` has no attribute,
under the names of :mod:`~er_gym.tasks.paper_records`, so that the tasks can be written into a test
file. Attributes for which the format has no field are stored in a task's object under ``er_gym``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any

from er_gym.tasks import paper_records
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import TaskFile, UnreadTask, known_scene, known_type, validated
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import TASK_TYPES, TaskType
from er_gym.writing import check_output, make_folder, write_output

_ENDING = "_task_metadata.json"
_SCENE = re.compile(r"FloorPlan(\d+)\w*")


def read_generator_tasks(path: str | Path) -> list[Task]:
    """Read files of the paper's generator.

    Args:
        path: a file, or a folder that holds such files at any depth; other files are ignored.

    Returns:
        Tasks in the order of room kinds, scenes and types. Their ids are those of ``er_gym`` or
        such as ``FloorPlan1-single_search-3``, with the number in the file, from 1.

    Raises:
        TaskFileError: there is no file, or one cannot be used; one line says where and why.
    """
    path = Path(path)
    return read_generated(path).all_or_none(path)


def read_generated(path: str | Path) -> TaskFile:
    """Read the usable tasks of files of the paper's generator; see :func:`read_generator_tasks`.

    Raises:
        TaskFileError: there is no file, or one of them cannot be used at all.
    """
    path = Path(path)
    files = sorted(path.rglob(f"*{_ENDING}"), key=_order) if path.is_dir() else [path]
    if not files:
        raise TaskFileError(
            f"{path}: no file of the paper's generator in this folder or below; "
            f"their names end in {_ENDING}"
        )
    return TaskFile.of(entry for file in files for entry in _entries(file, path))


def write_generator_tasks(
    folder: str | Path, tasks: Iterable[Task], *, force: bool = True
) -> list[Path]:
    """Write tasks in the format of the paper's generator, one file for each scene and type.

    Other files in the folder stay.

    Args:
        folder: the folder; it is created if it does not exist.
        tasks: the tasks.
        force: whether to replace existing files. Without it, nothing is written if one of the
            files exists with other content.

    Returns:
        The files, in the order in which :func:`read_generator_tasks` reads them.

    Raises:
        TaskFileError: a task's ``extra`` holds fields with which the task could not be read again.
        ForeignFile, CannotWrite: see :func:`~er_gym.writing.write_output`.
    """
    groups: dict[Path, list[Task]] = {}
    for task in tasks:
        file = Path(folder, _room(task.scene), task.scene, _slug(task.type) + _ENDING)
        groups.setdefault(file, []).append(task)
    content = {
        file: paper_records.as_json(
            file, [_record(task, file, number) for number, task in enumerate(group, 1)]
        )
        for file, group in sorted(groups.items(), key=lambda item: _order(item[0]))
    }
    for file, data in content.items():
        if file.exists():
            check_output(file, data, force=force)
    for file, data in content.items():
        make_folder(file.parent)
        write_output(file, data, force=force)
    return list(content)


def _entries(path: Path, top: Path) -> list[UnreadTask]:
    example = (
        "the files of the paper's generator look like "
        '[{"taskname": …, "tasktype": …, "actions": …}, …]'
    )
    data = paper_records.read_json(path, list, "tasks", example)
    if any(isinstance(item, dict) and "task_metadata" in item for item in data):
        raise TaskFileError(
            f"{path}: this is a test file; read it with er_gym.tasks.paper_format.read_tasks"
        )
    name = "" if path == top else f"{path.relative_to(top)}: "

    def entry(item: object, number: int) -> UnreadTask:
        where = f"{name}task {number}"
        return UnreadTask(where, "", lambda: _read_task(item, path, number, where))

    return [entry(item, number) for number, item in enumerate(data, 1)]


def _read_task(data: object, path: Path, number: int, where: str) -> Task:
    paper = validated(paper_records.PaperGeneratedTask, data, where)
    scene, kind = _scene(paper.metadatapath, path, where), known_type(paper.tasktype, where)
    metadata = paper_records.extra_fields(paper)
    if paper.metadatapath:
        metadata["metadatapath"] = paper.metadatapath
    task = Task(
        id=f"{scene}-{_slug(kind)}-{number}",
        type=kind,
        scene=scene,
        instruction=paper.taskname,
        name=paper.taskname,
        key_actions=paper_records.key_actions(paper.actions, where),
        extra={
            "task_metadata": metadata,
            "actions": [paper_records.extra_action_fields(action) for action in paper.actions],
        },
    )
    return paper_records.with_own_fields(task, paper.er_gym, where)


def _record(task: Task, path: Path, number: int) -> dict[str, Any]:
    record = {
        "taskname": task.name,
        "tasktype": task.type.name,
        "metadatapath": f"taskgenerate/{_room(task.scene)}/{task.scene}/metadata.json",
        **paper_records.metadata_record(task),
    }
    # The copies in a test file may contradict the task: in one task of the paper they do.
    record["tasktype"] = task.type.name
    record.pop("er_gym", None)
    return record | paper_records.own_fields(
        task, _read_task(record, path, number, f"{path}: task {number}")
    )


def _scene(metadatapath: str, path: Path, where: str) -> str:
    """The scene of a task; some paths of the paper have a literal ``{scene}`` instead of a name."""
    folder = path.absolute().parent.name
    for name in (metadatapath, folder):
        found = _SCENE.search(name)
        with suppress(TaskFileError):
            return known_scene(found[0] if found else "", where)
    raise TaskFileError(
        f"{where} names no scene: neither its metadatapath {metadatapath!r} nor its folder "
        f"{folder!r} names one, such as FloorPlan1"
    )


def _order(path: Path) -> tuple[float, int, str]:
    """By scene number, which orders kinds of room, then by type; other names come last."""
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
