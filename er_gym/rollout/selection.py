"""Selects the tasks of a suite that a run plays."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from er_gym.tasks.errors import SetAsideTask, summarise_set_aside
from er_gym.tasks.task import Task
from er_gym.tasks.types import canonical_names


@dataclass(frozen=True)
class Shard:
    """Part ``index`` of ``count`` parts of a suite, counted from 1."""

    index: int
    count: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Read ``"2/8"``.

        Raises:
            ValueError: the text is not ``i/n``, or i is not in 1..n.
        """
        index, slash, count = text.partition("/")
        if slash and index.isdecimal() and count.isdecimal() and 1 <= int(index) <= int(count):
            return cls(int(index), int(count))
        raise ValueError(f"{text!r} is not a shard: give i/n with 1 <= i <= n, such as 2/8")

    def __contains__(self, task_id: str) -> bool:
        """Whether a task is in the shard. A hash of its id decides, the same on every machine."""
        return _number(task_id) % self.count == self.index - 1


def select(
    tasks: Sequence[Task],
    *,
    task_ids: Iterable[str] = (),
    types: Iterable[str] = (),
    shard: Shard | None = None,
    limit: int | None = None,
    skip: int = 0,
    spread: bool = False,
    set_aside: Iterable[SetAsideTask] = (),
) -> list[Task]:
    """The tasks to play, in the suite's order.

    The selection starts from the named tasks (all tasks if none is named) of the named types (all
    types if none is named). It keeps those in the shard, leaves out the first ``skip`` of these,
    and keeps the ``limit`` after them. With ``spread`` the first tasks are those whose ids have the
    lowest hashes: a random sample, the same on every machine. A larger limit adds tasks, and
    ``skip=n`` leaves out exactly what ``limit=n`` keeps. Tasks that were set aside are never
    played.

    Raises:
        ValueError: the suite has no task of a given id, or all that were named are set aside; or a
            type is unknown, or no task is of the types; or ``skip`` leaves none.
    """
    wanted, kinds = set(task_ids), set(canonical_names(types))
    aside = [one for one in set_aside if one.task in wanted]
    unknown = wanted.difference((task.id for task in tasks), (one.task for one in aside))
    if aside and len(aside) == len(wanted):
        raise ValueError(f"no task to play: {summarise_set_aside(aside)}")
    if unknown:
        some = ", ".join(task.id for task in tasks[:3])
        raise ValueError(f"no task with the id {min(unknown)!r}; ids here are such as {some}")
    chosen = [
        task
        for task in tasks
        if (not wanted or task.id in wanted)
        and (not kinds or task.type.name in kinds)
        and (shard is None or task.id in shard)
    ]
    if kinds and shard is None and not chosen:
        there = ", ".join(dict.fromkeys(task.type.name for task in tasks))
        raise ValueError(
            f"no task to play is of the types {', '.join(sorted(kinds))}; there are {there}"
        )
    if skip and skip >= len(chosen):
        raise ValueError(f"no task to play: all {len(chosen)} are skipped; skip fewer than {skip}")
    end = None if limit is None else skip + limit
    if not spread:
        return chosen[skip:end]
    kept = {task.id for task in sorted(chosen, key=lambda task: _number(task.id))[skip:end]}
    return [task for task in chosen if task.id in kept]


def _number(task_id: str) -> int:
    """A number that looks random, the same on every machine."""
    return int.from_bytes(hashlib.sha256(task_id.encode()).digest()[:8], "big")
