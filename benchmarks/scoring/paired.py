"""How much better one run is than another, over the tasks that both played."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.scoring.metrics import Estimate, Score, normal
from benchmarks.scoring.samples import Sampled


def paired_difference(
    before: Sequence[Sampled], after: Sequence[Sampled], metric: str = "success"
) -> Estimate:
    """The mean difference of a metric with its 95 % interval, paired over tasks.

    Pairing takes out how hard each task is, so the interval is narrower than one of two separate
    means. A task that was played several times counts with its mean.

    Args:
        before, after: the scores of two runs of the same suite.
        metric: a field of :class:`~benchmarks.scoring.metrics.Score`, or of what these are.

    Raises:
        ValueError: the runs have no task in common.
    """
    first, second = _by_task(before, metric), _by_task(after, metric)
    common = [task for task in first if task in second]
    if not common:
        raise ValueError("the two runs have no task in common")
    return normal([second[task] - first[task] for task in common])


def paired_change(
    first: tuple[Sequence[Score], Sequence[Score]],
    second: tuple[Sequence[Score], Sequence[Score]],
    metric: str = "success",
) -> Estimate:
    """How much more a metric changes for one agent than for another, with its 95 % interval.

    Args:
        first, second: of each agent, the scores of a run before and of one after the change; all
            runs are of the same suite.
        metric: as for :func:`paired_difference`.

    Raises:
        ValueError: the runs have no task in common.
    """
    runs = [_by_task(each, metric) for each in (*first, *second)]
    common = [task for task in runs[0] if all(task in run for run in runs)]
    if not common:
        raise ValueError("the runs have no task in common")
    before, after, other_before, other_after = runs
    return normal([(other_after[t] - other_before[t]) - (after[t] - before[t]) for t in common])


def _by_task(scores: Sequence[Sampled], metric: str) -> dict[str, float]:
    found: dict[str, list[float]] = {}
    for each in scores:
        found.setdefault(each.task_id, []).append(float(getattr(each, metric)))
    return {task: sum(values) / len(values) for task, values in found.items()}
