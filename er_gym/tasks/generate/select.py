"""Choosing a suite's tasks from the candidates of many scenes."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import islice

from er_gym.tasks import verbs
from er_gym.tasks.rooms import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME


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
