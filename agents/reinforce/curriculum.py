"""Which tasks are played next."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from agents.reinforce.settings import CurriculumSettings
from er_gym.tasks.task import Task

_UNKNOWN = 0.5
"""The success of a type of which nothing has been played."""


def chosen_tasks(
    tasks: Sequence[Task],
    success: Mapping[str, float],
    count: int,
    settings: CurriculumSettings,
    seed: Sequence[int],
) -> list[Task]:
    """Tasks to play, each at most once.

    Args:
        tasks: of the suite.
        success: the model's by type of task, a fraction.
        count: how many; fewer if the suite has fewer.
        settings: how types are weighed.
        seed: of the draw.
    """
    draw = np.random.default_rng(list(seed))
    weight = {
        name: _weight(success.get(name, _UNKNOWN), settings.floor)
        for name in {task.type.name for task in tasks}
    }
    size = Counter(task.type.name for task in tasks)
    # Each type by its weight, however many tasks it has.
    chances = np.array([weight[task.type.name] / size[task.type.name] for task in tasks])
    places = draw.choice(
        len(tasks), min(count, len(tasks)), replace=False, p=chances / chances.sum()
    )
    return [tasks[place] for place in places.tolist()]


def _weight(success: float, floor: float) -> float:
    return success * (1 - success) + floor


def with_results(
    success: Mapping[str, float], results: Sequence[tuple[str, bool]], memory: float
) -> dict[str, float]:
    """The success by type after some episodes.

    Args:
        success: by type before.
        results: type of the task and success of each episode.
        memory: how much of the success of before stays.
    """
    by_type: dict[str, list[bool]] = defaultdict(list)
    for name, done in results:
        by_type[name].append(done)
    found = dict(success)
    for name, each in by_type.items():
        now = sum(each) / len(each)
        found[name] = memory * found.get(name, now) + (1 - memory) * now
    return found
