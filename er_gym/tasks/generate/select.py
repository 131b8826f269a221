"""Choose a suite's tasks from the tasks of many scenes."""

from __future__ import annotations

import random
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from itertools import islice
from statistics import fmean

from er_gym.tasks import verbs
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, TaskType


def select_balanced(tasks: Iterable[Task], total: int, rng: random.Random) -> list[Task]:
    """Choose tasks that are balanced by type, kind of room, scene and object.

    All types get equal shares; if a type has fewer tasks, the others share the rest. Within a type,
    tasks are chosen one after another. Each choice takes the kind of room that this type has used
    least, then the scene that this type has used least, then the scene that all types have used
    least, then the recipe used least, then the task whose object types and verbs this type has used
    least. ``rng`` decides between equals.

    Args:
        tasks: the candidates.
        total: how many tasks to choose; fewer are chosen if the candidates run out.
        rng: the only source of randomness.

    Returns:
        The tasks in the order of task types, then of scenes.
    """
    pools: defaultdict[TaskType, defaultdict[str, list[Task]]]
    pools = defaultdict(lambda: defaultdict(list))
    for task in tasks:
        pools[task.type][task.scene].append(task)
    sizes = {kind: sum(map(len, pools[kind].values())) for kind in BY_NAME.values()}
    quotas = shares(total, sizes)
    scene_uses: Counter[str] = Counter()
    chosen: list[Task] = []
    for kind in BY_NAME.values():
        pool = {scene: rng.sample(mine, len(mine)) for scene, mine in pools[kind].items()}
        picks = _evenly(pool, scene_uses, rng)
        chosen += sorted(islice(picks, quotas[kind]), key=_scene_number)
    return chosen


def shares(total: int, sizes: Mapping[TaskType, int]) -> dict[TaskType, int]:
    """How many tasks of each type to choose: equal numbers, as far as a type has enough."""
    quotas = dict.fromkeys(sizes, 0)
    left = min(total, sum(sizes.values()))
    while left:
        open_types = [kind for kind in sizes if quotas[kind] < sizes[kind]]
        each = max(left // len(open_types), 1)
        for kind in open_types:
            more = min(each, sizes[kind] - quotas[kind], left)
            quotas[kind] += more
            left -= more
    return quotas


def _evenly(
    pool: dict[str, list[Task]], scene_uses: Counter[str], rng: random.Random
) -> Iterator[Task]:
    """Yield the tasks of one type in a balanced order; empties ``pool``."""
    kind_uses: Counter[str] = Counter()
    type_uses: Counter[str] = Counter()
    rule_uses: Counter[str] = Counter()
    word_uses: Counter[str] = Counter()
    while pool:
        scene = min(
            rng.sample(sorted(pool), len(pool)),
            key=lambda name: (kind_uses[room_kind(name)], type_uses[name], scene_uses[name]),
        )
        task = min(
            pool[scene],
            key=lambda task: (
                rule_uses[_rule(task)],
                # The mean: the sum would favour short tasks.
                fmean(word_uses[word] for word in _words(task)),
            ),
        )
        pool[scene].remove(task)
        if not pool[scene]:
            del pool[scene]
        kind_uses[room_kind(scene)] += 1
        type_uses[scene] += 1
        rule_uses[_rule(task)] += 1
        scene_uses[scene] += 1
        word_uses.update(_words(task))
        yield task


def _rule(task: Task) -> str:
    """The rule that made the task: long-range tasks come from several recipes."""
    return str(task.extra.get("made_by", ""))


def _words(task: Task) -> set[str]:
    """The object types and the verbs of a task's key actions."""
    acted_on = {action.object_type for action in task.key_actions if action.verb != verbs.END}
    return acted_on | {action.verb for action in task.key_actions}


def _scene_number(task: Task) -> int:
    return int("".join(filter(str.isdigit, task.scene)))
