"""Runs in which tasks were played several times: intervals over tasks, and pass@k.

Episodes of one task are alike, so they tell less than as many episodes of different tasks. The
standard error of a mean is therefore taken between tasks (a cluster-robust one, as for a survey
that asks whole households).
"""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

T = TypeVar("T")


class Sampled(Protocol):
    """What is needed of a score."""

    @property
    def task_id(self) -> str:
        """The task that was played."""

    @property
    def success(self) -> bool:
        """Whether it was done."""


def most_samples(scores: Iterable[Sampled]) -> int:
    """How many episodes the most often played task has; 0 without any."""
    return max(Counter(each.task_id for each in scores).values(), default=0)


def arrangement_of(scene: str, task_id: str) -> str:
    """The room of a task, and which of its arrangements.

    The id of a generated task begins with the scene and, if the scene is rearranged, a number.
    Others are of the scene as it was recorded.
    """
    number = task_id.removeprefix(f"{scene}-").partition("-")[0]
    return f"{scene}-{number}" if number.isdigit() and task_id.startswith(f"{scene}-") else scene


def variance_between(tasks: Sequence[str], values: Sequence[float]) -> float | None:
    """The variance of the mean of some values, each of an episode of a task.

    Args:
        tasks: (n,) the task of each episode.
        values: (n,) its value.

    Returns:
        T / (T - 1) * sum over tasks of (sum of its values' differences from the mean)^2 / n^2, with
        T tasks; None for fewer than two.
    """
    n = len(values)
    mean = math.fsum(values) / n
    sums: defaultdict[str, float] = defaultdict(float)
    for task, value in zip(tasks, values, strict=True):
        sums[task] += value - mean
    if len(sums) < 2:
        return None
    total = math.fsum(each**2 for each in sums.values())
    return len(sums) / (len(sums) - 1) * total / n**2


def effective_number(tasks: Sequence[str], successes: Sequence[bool]) -> float:
    """The effective sample size: how many episodes of different tasks give as narrow an interval.

    It lies between what there is if all episodes of a task come out alike, and the number of
    episodes, if they are as different as those of different tasks. The former is the number of
    tasks, and less if some have more episodes than others: n^2 / sum of squares of their numbers
    of episodes (Kish).
    """
    n = len(successes)
    least = n**2 / sum(number**2 for number in Counter(tasks).values())
    rate = sum(successes) / n
    variance = variance_between(tasks, successes)
    if not variance or rate in (0.0, 1.0):
        return least
    return min(max(rate * (1 - rate) / variance, least), float(n))


def pass_at(k: int, n: int, successes: int) -> float:
    """The probability that at least one of ``k`` samples succeeds, given that ``successes`` of
    ``n`` did: 1 - C(n - successes, k) / C(n, k), the unbiased estimate of Chen et al. (2021).

    Raises:
        ValueError: ``k`` is not in 1..n.
    """
    if not 1 <= k <= n:
        raise ValueError(f"pass@{k} needs from 1 to {n} samples, since there are {n}")
    return 1.0 - math.comb(n - successes, k) / math.comb(n, k)


@dataclass(frozen=True)
class TaskSamples:
    """The samples of some tasks.

    Attributes:
        tasks: how many tasks have ``samples`` samples; the others are not counted.
        samples: the most samples that a task has.
        pass_at: k to the mean of pass@k over the tasks; k is 1, 2, 4 ... and ``samples``.
        always: the share of tasks of which every sample succeeded.
    """

    tasks: int
    samples: int
    pass_at: dict[int, float]
    always: float


def task_samples(scores: Sequence[Sampled], samples: int) -> TaskSamples | None:
    """Success by task, of the tasks that have ``samples`` samples; None if there is none."""
    played = Counter(each.task_id for each in scores)
    done = Counter(each.task_id for each in scores if each.success)
    counts = [done[task] for task, number in played.items() if number == samples]
    if not counts:
        return None
    return TaskSamples(
        tasks=len(counts),
        samples=samples,
        pass_at={
            k: math.fsum(pass_at(k, samples, count) for count in counts) / len(counts)
            for k in doubling(samples)
        },
        always=sum(count == samples for count in counts) / len(counts),
    )


def doubling(most: int) -> list[int]:
    """1, 2, 4 ... and ``most``."""
    steps = [2**power for power in range(most.bit_length()) if 2**power < most]
    return [*steps, most]


def group_by(scores: Iterable[T], key: Callable[[T], str]) -> dict[str, list[T]]:
    """The scores with each value of ``key``."""
    parts: defaultdict[str, list[T]] = defaultdict(list)
    for each in scores:
        parts[key(each)].append(each)
    return parts
