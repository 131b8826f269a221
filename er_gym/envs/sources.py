"""Sources of episodes: a list of tasks, a suite, a task file, or the generator."""

from __future__ import annotations

import os
import warnings
from collections import defaultdict
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeAlias, runtime_checkable

import numpy as np

from er_gym.envs.arguments import short_repr
from er_gym.tasks.errors import TaskFileError, describe_substitutions, summarise_set_aside
from er_gym.tasks.resolve import resolve_tasks
from er_gym.tasks.suites import load_suite, own_tasks, suite_file, suite_from_file, suite_names
from er_gym.tasks.task import Task
from er_gym.tasks.types import TaskType

if TYPE_CHECKING:
    from er_gym.envs.verify import PlayableEnv

_LONGEST_NAME = 80
"""A message quotes at most this many characters of a name."""
GENERATE = "generate"
"""The name of the endless source."""


@runtime_checkable
class EpisodeSource(Protocol):
    """A source that tasks are drawn from."""

    def draw(self, rng: np.random.Generator, task_type: TaskType | None, scene: str | None) -> Task:
        """Draw a task. Random generators in the same state draw the same task.

        Args:
            rng: the random generator.
            task_type: the type of the task, None for any.
            scene: the scene of the task, None for any.

        Raises:
            ValueError: the source has no such task.
        """
        ...

    def find(self, task_id: str) -> Task:
        """The task with an id.

        Raises:
            ValueError: the source has no such task.
        """
        ...


Source: TypeAlias = EpisodeSource | Sequence[Task] | str | Path


class TaskList:
    """Draws from a list of tasks, each as likely as any other."""

    def __init__(self, tasks: Sequence[Task], name: str = "this environment") -> None:
        self.tasks = tuple(tasks)
        self._name = name

    @cached_property
    def _fitting(self) -> dict[tuple[str, str], list[Task]]:
        """The tasks by type name and scene; ``""`` stands for any."""
        found: defaultdict[tuple[str, str], list[Task]] = defaultdict(list)
        for task in self.tasks:
            for kind in (task.type.name, ""):
                for scene in (task.scene, ""):
                    found[kind, scene].append(task)
        return found

    def draw(self, rng: np.random.Generator, task_type: TaskType | None, scene: str | None) -> Task:
        """Draw one of the tasks that fit."""
        kind = task_type.name if task_type else ""
        fitting = self._fitting.get((kind, scene or ""))
        if not fitting:
            asked = " ".join(filter(None, [kind, "tasks", scene and f"in {scene[:_LONGEST_NAME]}"]))
            among = f" among its {len(self.tasks)} tasks" if self.tasks else ""
            raise ValueError(f"{self._name} has no {asked}{among}")
        return fitting[int(rng.integers(len(fitting)))]

    @lru_cache(maxsize=64)  # noqa: B019  (few lists, and they are kept anyhow)
    def share(self, index: int, count: int) -> TaskList:
        """The tasks of every ``count``-th scene, from the ``index``-th on.

        An engine's caches of a room serve its own process only, so processes are faster if each
        plays in rooms of its own. If a share lacked a task type, all tasks are returned.
        """
        scenes = sorted({task.scene for task in self.tasks})
        share_of = {scene: place % count for place, scene in enumerate(scenes)}
        types = {task.type for task in self.tasks}
        if len({(share_of[task.scene], task.type) for task in self.tasks}) < count * len(types):
            return self
        mine = [task for task in self.tasks if share_of[task.scene] == index]
        return TaskList(mine, self._name)

    def find(self, task_id: str) -> Task:
        """The task with that id."""
        for task in self.tasks:
            if task.id == task_id:
                return task
        raise ValueError(
            f"no task {short_repr(task_id)} among the {len(self.tasks)} of {self._name}"
        )


def make_source(source: Source, make_env: Callable[[], PlayableEnv]) -> EpisodeSource:
    """The source that :class:`~er_gym.envs.embodied_env.EmbodiedEnv` draws tasks from.

    Tasks of a file that cannot be used, or do not fit their scenes, are not drawn. A warning names
    them.

    Args:
        source: a list of tasks, the name of a suite, the path of a task file (``.json``, ``.jsonl``
            or ``.jsonl.gz``), ``"generate"``, or an :class:`EpisodeSource`.
        make_env: makes the environment in which generated tasks are verified.

    Raises:
        ValueError: there is no such suite, or the file cannot be used.
    """
    if isinstance(source, str) and source == GENERATE:
        from er_gym.envs.generated_source import GeneratedSource  # late: few need the generator

        return GeneratedSource(make_env())
    if isinstance(source, str | Path):
        name = str(source)
        is_file = "/" in name or name.endswith((".json", ".jsonl", ".jsonl.gz"))
        path = Path(name).resolve()
        if name in suite_names():
            path = suite_file(name)
        # os.path's function treats a name that is too long as a file that does not exist.
        changed = path.stat().st_mtime_ns if os.path.isfile(path) else 0
        found, remarks = _read(str(path) if is_file else name, is_file, changed)
        if remarks:
            warnings.warn(remarks, stacklevel=3)
        return found
    if isinstance(source, EpisodeSource):
        return source
    if isinstance(source, Sequence):
        tasks = [task for task in source if isinstance(task, Task)]
        if len(tasks) == len(source):
            return TaskList(tasks)
    raise ValueError(
        f"{short_repr(source)} is not a source of episodes; give a suite's name, a task file, "
        f"{GENERATE!r}, a list of tasks, or an EpisodeSource"
    )


@lru_cache(maxsize=16)
def _read(name: str, is_file: bool, changed: int) -> tuple[TaskList, str]:
    """The tasks of a suite or file, cached until it changes; and remarks for a warning."""
    if not is_file and name in suite_names():
        return TaskList(own_tasks(name), f"the suite {name}"), ""
    suite = suite_from_file(name) if is_file else load_suite(name)
    if not is_file:
        return TaskList(suite.tasks, f"the suite {suite.name}"), ""
    fitted = resolve_tasks(suite.tasks, arrange=False)
    aside = (*suite.set_aside, *fitted.set_aside)
    if aside and not fitted.tasks:
        raise TaskFileError(f"{name}: no task can be played: {summarise_set_aside(aside)}")
    remarks = describe_substitutions(fitted.substitutions)
    if aside:
        every = len(fitted.tasks) + len(aside)
        remarks.insert(0, f"{len(aside)} of {every} tasks set aside: {summarise_set_aside(aside)}")
    told = f"{name}: {'; '.join(remarks)}" if remarks else ""
    return TaskList(fitted.tasks, f"the suite {suite.name}"), told
