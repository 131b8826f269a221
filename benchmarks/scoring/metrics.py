"""The metrics of an episode: pure functions over :class:`~er_gym.rollout.records.EpisodeRecord`.

The definitions are those of the Embodied-Reasoner benchmark (arXiv 2503.21696) as its released
program computes them, so the numbers compare with its table. A scorer
(:mod:`benchmarks.scoring.scorers`) walks through an episode once. Every metric is one small
function of its counts and the episode. :func:`score_episode` puts them side by side, and
:func:`summarise` takes their means.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

from benchmarks.scoring.samples import effective_number, most_samples, variance_between
from benchmarks.scoring.scorers import JUDGED_BY_NAME, KeyActionCounts, Scorer
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.types import task_type
from er_gym.tasks.verbs import END, NAVIGATE

_Z = 1.959963984540054  # the 97.5 % point of the normal distribution


def completeness(counted: KeyActionCounts) -> float:
    """The share of the scoring key actions that were done; whether it succeeded if it has none.

    An ``end`` is done where the scorer says so: to the judge, only an ``end`` that is a success.
    Above 1 under ``paper`` in a task that does not ask for the ``end`` that scored.
    """
    if not counted.expected:
        return float(counted.success)
    return counted.points / len(counted.expected)


def search_efficiency(episode: EpisodeRecord, counted: KeyActionCounts) -> float:
    """(key actions + 1) / steps for a success, else 0.

    Navigations and ``end`` are among the key actions; ``init``, the one more, and ``end`` are among
    the steps. Above 1 if the agent found a shorter way than the task's.
    """
    return (len(episode.key_actions) + 1) / counted.steps if counted.success else 0.0


def ordered_completeness(episode: EpisodeRecord, counted: KeyActionCounts) -> float:
    """The longest common subsequence of done and expected, over expected.

    A ``single_search`` has nothing to order: its completeness.
    """
    if episode.task_type == JUDGED_BY_NAME or not counted.expected:
        return completeness(counted)
    return _longest_common(counted.scored, counted.expected) / len(counted.expected)


def repeat_rate(counted: KeyActionCounts) -> float:
    """The share of navigations, failed ones too, that name a type navigated to before."""
    return _share_repeated(counted.navigated_to)


def revisit_rate(episode: EpisodeRecord) -> float:
    """The share of navigations that lead to an object navigated to before.

    Where the environment goes on to the next cabinet, :func:`repeat_rate` counts a second
    ``navigate to Cabinet`` and this does not. A navigation that was refused leads to no object: it
    counts by its type.
    """
    moves = (step for step in episode.steps if step.verb == NAVIGATE)
    return _share_repeated([move.object_id or move.object_type for move in moves])


def _share_repeated(visited: Sequence[str]) -> float:
    return (len(visited) - len(set(visited))) / len(visited) if visited else 0.0


def steps_saved(episode: EpisodeRecord) -> float:
    """(max_steps - steps) / max_steps, successful or not: another efficiency in circulation.

    0 where the paper's protocol says ``end`` beyond the step limit.
    """
    return max(episode.max_steps - episode.num_steps, 0) / episode.max_steps


def key_action_precision(episode: EpisodeRecord, counted: KeyActionCounts) -> float:
    """Key actions done, navigations among them, over actions predicted (``init`` is none).

    The completeness of the paper's text; its scorer computes :func:`completeness`.
    """
    predicted = len(episode.predicted)
    return (counted.points + counted.navigations_done) / predicted if predicted else 0.0


def _longest_common(first: Sequence[str], second: Sequence[str]) -> int:
    """The length of the longest common subsequence."""
    row = [0] * (len(second) + 1)
    for item in first:
        diagonal = 0
        for column, other in enumerate(second, start=1):
            above = row[column]
            row[column] = diagonal + 1 if item == other else max(above, row[column - 1])
            diagonal = above
    return row[-1]


@dataclass(frozen=True)
class Score:
    """An episode's metrics under one scorer; each but ``success`` is the function of its name.

    Attributes:
        task_id, task_type, group: what was played.
        success: as counted; also where the paper's program gives more than 1, as it does in a task
            whose only other key action was done and that does not ask for ``end``.
        missing: the scoring key actions that were not done, as ``"verb Type"``.
        sample: which of the task's episodes it is, from 1.
        tidy_success: whether it is a success without side effects; None for a success of which the
            record does not tell them.
        side_effects: how many objects were changed that the task did not ask for
            (:mod:`er_gym.tasks.side_effects`); None if the record does not tell.
    """

    task_id: str
    task_type: str
    group: str
    success: bool
    search_efficiency: float
    completeness: float
    ordered_completeness: float
    repeat_rate: float
    revisit_rate: float
    steps_saved: float
    key_action_precision: float
    missing: tuple[str, ...]
    sample: int = 1
    tidy_success: bool | None = None
    side_effects: int | None = None


METRICS = (
    "success",
    "search_efficiency",
    "completeness",
    "ordered_completeness",
    "repeat_rate",
    "revisit_rate",
    "steps_saved",
    "key_action_precision",
)
"""The fields of :class:`Score` that are averaged, in the order in which reports give them."""
TIDY, SIDE_EFFECTS = "tidy_success", "side_effects"
IF_TOLD = (TIDY, SIDE_EFFECTS)
"""Further ones, which are averaged where every score has them: older records lack them."""


def tidy_success(success: bool, side_effects: int | None) -> bool | None:
    """Whether an episode is a success without side effects; None for a success of which nobody
    tells them (a failure is none, whatever else it did)."""
    if success and side_effects is None:
        return None
    return success and not side_effects


def score_episode(episode: EpisodeRecord, scorer: Scorer) -> Score:
    """All metrics of one episode."""
    counted = scorer.count(episode)
    missing = Counter(counted.expected) - Counter(counted.scored)
    if counted.points > len(counted.scored):
        missing.pop(END, None)
    effects = None if episode.side_effects is None else len(episode.side_effects)
    return Score(
        task_id=episode.task_id,
        task_type=episode.task_type,
        group=task_type(episode.task_type).group,
        success=counted.success,
        search_efficiency=search_efficiency(episode, counted),
        completeness=completeness(counted),
        ordered_completeness=ordered_completeness(episode, counted),
        repeat_rate=repeat_rate(counted),
        revisit_rate=revisit_rate(episode),
        steps_saved=steps_saved(episode),
        key_action_precision=key_action_precision(episode, counted),
        missing=tuple(missing.elements()),
        sample=episode.sample,
        tidy_success=tidy_success(counted.success, effects),
        side_effects=effects,
    )


@dataclass(frozen=True)
class Estimate:
    """A mean with its 95 % interval; ``low`` and ``high`` are None if n is too small for one."""

    mean: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Summary:
    """The means over ``n`` episodes: one :class:`Estimate` for each of :data:`METRICS`, and of
    :data:`IF_TOLD` where all episodes tell."""

    n: int
    metrics: dict[str, Estimate]

    def __getitem__(self, metric: str) -> Estimate:
        return self.metrics[metric]

    def get(self, metric: str) -> Estimate | None:
        """The estimate of a metric; None if an episode does not tell it."""
        return self.metrics.get(metric)


def wilson(successes: int, n: int) -> Estimate:
    """A rate of success with Wilson's score interval, which holds for rates near 0 and 1 too.

    Raises:
        ValueError: ``n`` is 0.
    """
    if n == 0:
        raise ValueError("no episodes: a rate needs at least one")
    return _wilson(successes / n, n)


def success_rate(tasks: Sequence[str], successes: Sequence[bool]) -> Estimate:
    """The rate of success of some episodes with Wilson's interval.

    Where tasks were played several times, the interval is that for the number of episodes of
    different tasks that would tell as much (:mod:`benchmarks.scoring.samples`).

    Args:
        tasks: (n,) the task of each episode.
        successes: (n,) whether it counts as a success (:mod:`er_gym.rollout.outcomes`).

    Raises:
        ValueError: there are no episodes.
    """
    if not successes:
        raise ValueError("no episodes: a rate needs at least one")
    return _wilson(sum(successes) / len(successes), effective_number(tasks, successes))


def _wilson(rate: float, n: float) -> Estimate:
    scale = 1 + _Z**2 / n
    centre = (rate + _Z**2 / (2 * n)) / scale
    half = _Z / scale * math.sqrt(rate * (1 - rate) / n + _Z**2 / (4 * n**2))
    # At the ends the interval touches 0 or 1, and so the rate, but for rounding.
    return Estimate(rate, max(min(centre - half, rate), 0.0), min(max(centre + half, rate), 1.0))


def normal(values: Sequence[float]) -> Estimate:
    """A mean with the normal interval, 1.96 standard errors to each side.

    The standard error is that of the sample (n - 1). The interval is somewhat narrow for n below
    about 20, missing for one value, and not cut at 0 or 1.

    Raises:
        ValueError: ``values`` is empty.
    """
    n = len(values)
    if n == 0:
        raise ValueError("no episodes: a mean needs at least one")
    mean = math.fsum(values) / n
    if n == 1:
        return Estimate(mean, None, None)
    half = _Z * math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (n - 1) / n)
    return Estimate(mean, mean - half, mean + half)


def between(groups: Sequence[str], values: Sequence[float]) -> Estimate:
    """A mean with the normal interval of the standard error between groups; missing for one group.

    Args:
        groups: (n,) what each value belongs to and shares with others, such as its task.
        values: (n,) at least one.
    """
    mean = math.fsum(values) / len(values)
    variance = variance_between(groups, values)
    if variance is None:
        return Estimate(mean, None, None)
    half = _Z * math.sqrt(variance)
    return Estimate(mean, mean - half, mean + half)


def _within(estimate: Estimate, most: float) -> Estimate:
    """The same mean, with the part of its interval that lies from 0 to ``most``."""
    if estimate.low is None or estimate.high is None:
        return estimate
    return replace(estimate, low=max(estimate.low, 0.0), high=min(estimate.high, most))


def summarise(scores: Sequence[Score]) -> Summary:
    """Means over episodes with 95 % intervals: Wilson's for success and tidy success, the normal
    one for the rest.

    No metric is below 0. An interval ends there, and at 1 unless an episode has more than 1.

    Where tasks were played several times, the intervals are those between tasks: the normal one of
    that standard error, and Wilson's for the number of episodes of different tasks that would tell
    as much (:mod:`benchmarks.scoring.samples`).

    Raises:
        ValueError: there are no scores.
    """
    tasks = [each.task_id for each in scores]
    several = most_samples(scores) > 1
    means = {
        metric: estimate_of(metric, tasks, [getattr(each, metric) for each in scores], several)
        for metric in METRICS
    }
    told = {name: [getattr(each, name) for each in scores] for name in IF_TOLD}
    if None not in told[TIDY]:
        means[TIDY] = success_rate(tasks, told[TIDY])
    if None not in told[SIDE_EFFECTS]:
        effects = told[SIDE_EFFECTS]
        mean = between(tasks, effects) if several else normal(effects)
        means[SIDE_EFFECTS] = _within(mean, max(effects))
    return Summary(len(scores), means)


def estimate_of(
    metric: str, tasks: Sequence[str], values: Sequence[float], several: bool
) -> Estimate:
    """The mean of a metric over episodes, as :func:`summarise` has it.

    Args:
        metric: one of :data:`METRICS`.
        tasks, values: (n,) the task of each episode, and its value.
        several: whether tasks were played several times.

    Raises:
        ValueError: there are no episodes.
    """
    if metric == "success":
        return success_rate(tasks, [bool(value) for value in values])
    mean = between(tasks, values) if several else normal(values)
    return _within(mean, max(1.0, *values))


def summarise_by(
    scores: Iterable[Score], key: Callable[[Score], str], order: Iterable[str]
) -> dict[str, Summary]:
    """A summary for each value of ``key``, in the given order; values without scores are left out.

    Raises:
        KeyError: a score's key is not in ``order``.
    """
    parts: dict[str, list[Score]] = {name: [] for name in order}
    for each in scores:
        parts[key(each)].append(each)
    return {name: summarise(part) for name, part in parts.items() if part}
