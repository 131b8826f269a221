"""What an episode is worth: pure functions over :class:`~benchmarks.episode.EpisodeRecord`.

The definitions are those of the Embodied-Reasoner benchmark (arXiv 2503.21696) as its released
scorer computes them, so that numbers compare with its table. An episode is walked through once
(:func:`tally`); every metric is one small function of the tally and the episode;
:func:`score_episode` puts them side by side, and :func:`summarise` takes their means.

Two scorers (:data:`SCORERS`) read the key actions differently and are the same in all else:

* ``paper`` takes an action's object type as the task file states it. Some files leave the type of a
  ``put`` empty; no step can match that, so those tasks cannot be done.
* ``corrected`` takes the type from the key action's object id, and counts Sink and SinkBasin as one
  type, because files name the one and give the id of the other. Where a task singles an object out,
  it asks for that one; and a task's goal must hold for a success. The paper's files have neither.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from benchmarks.episode import EpisodeRecord, KeyActionRecord, StepRecord
from er_gym.tasks.task import type_of_id
from er_gym.tasks.types import task_type
from er_gym.tasks.verbs import END, NAVIGATE, UNSCORED, canonical_verb

_JUDGED_BY_NAME = "single_search"
"""The one task type whose ``end`` scores only if the task's name was answered."""

_Z = 1.959963984540054  # the 97.5 % point of the normal distribution


@dataclass(frozen=True)
class Scorer:
    """A reading of the object types.

    Attributes:
        name: as ``--scorer`` takes it.
        key_type: the type that a key action asks for.
        step_type: the type that a step counts as. It starts from the agent's word: the environment
            found the object by it, so unlike a file it cannot name another type.
        exact: whether it heeds which object a task singles out, and the task's goal.
    """

    name: str
    key_type: Callable[[KeyActionRecord], str]
    step_type: Callable[[StepRecord], str]
    exact: bool = False


def _one_sink(object_type: str) -> str:
    return "SinkBasin" if object_type == "Sink" else object_type


PAPER = Scorer("paper", lambda key: key.object_type, lambda step: step.object_type)
CORRECTED = Scorer(
    "corrected",
    lambda key: _one_sink(type_of_id(key.object_id) or key.object_type),
    lambda step: _one_sink(step.object_type),
    exact=True,
)
SCORERS = {scorer.name: scorer for scorer in (PAPER, CORRECTED)}


@dataclass(frozen=True)
class Tally:
    """The walk through an episode.

    Attributes:
        expected: the key actions that score, as ``"verb Type"``, in the order of the task.
        scored: those that were done, in the order of the episode. ``end`` is left out where the
            task's name decides about it.
        points: how many scored, that ``end`` included.
        routes: key actions done besides, which score nothing: navigations that the task lists.
        goal_holds: whether the final state is as the task asks, where the scorer heeds that.
    """

    expected: tuple[str, ...]
    scored: tuple[str, ...]
    points: int
    routes: int
    goal_holds: bool = True


def _label(verb: str, object_type: str) -> str:
    return f"{canonical_verb(verb)} {object_type}".rstrip()


def _key_label(key: KeyActionRecord, scorer: Scorer) -> str:
    label = _label(key.verb, scorer.key_type(key))
    return f"{label} {key.object_id}" if key.exact and scorer.exact else label


def _search_answered(episode: EpisodeRecord, end: StepRecord, came_from_key_action: bool) -> bool:
    """Whether ``end`` answers a search: a type within reach is named by the task, or the last look
    or move was a key action (going to where the target is)."""
    return any(kind in episode.name for kind in end.interactable) or came_from_key_action


def tally(episode: EpisodeRecord, scorer: Scorer) -> Tally:
    """Match an episode's steps with its task's key actions.

    Failed steps count for nothing. Each key action is matched at most once, in any order. ``end``
    scores, save in a ``single_search`` that it does not answer.
    """
    keys = [(key, _key_label(key, scorer)) for key in episode.key_actions]
    expected = [label for key, label in keys if canonical_verb(key.verb) not in UNSCORED]
    open_keys = Counter(label for _, label in keys)
    every_key = frozenset(open_keys)
    scored: list[str] = []
    points = routes = 0
    previous = ""
    for step in episode.steps:
        if not step.success:
            continue
        label = _label(step.verb, scorer.step_type(step))
        if step.verb == END:
            if label not in every_key:
                break  # a task that does not ask for it
            if episode.task_type != _JUDGED_BY_NAME:
                scored.append(label)
                points += 1
            elif _search_answered(episode, step, previous in every_key):
                points += 1
            break
        if open_keys[f"{label} {step.object_id}"] > 0:
            label = f"{label} {step.object_id}"
        # An object is needed: a key action whose type the file left empty has a label without one,
        # and must stay unmatched.
        if step.object_type and open_keys[label] > 0:
            open_keys[label] -= 1
            if step.verb in UNSCORED:
                routes += 1
            else:
                scored.append(label)
                points += 1
        if step.verb in UNSCORED:
            previous = label
    goal_holds = not (scorer.exact and episode.goal_unmet)
    return Tally(tuple(expected), tuple(scored), points, routes, goal_holds)


def completeness(counted: Tally) -> float:
    """The share of the scoring key actions that were done; 0 for a task that has none."""
    return min(counted.points / len(counted.expected), 1.0) if counted.expected else 0.0


def success(counted: Tally) -> bool:
    """Whether all of them were, and the goal holds."""
    return bool(counted.expected) and counted.points >= len(counted.expected) and counted.goal_holds


def search_efficiency(episode: EpisodeRecord, counted: Tally) -> float:
    """(key actions + 1) / recorded steps for a success, else 0.

    Navigations and ``end`` are among the key actions; ``init``, the one more, and ``end`` are among
    the steps. Above 1 if the agent found a shorter way than the task's.
    """
    return (len(episode.key_actions) + 1) / episode.num_steps if success(counted) else 0.0


def ordered_completeness(episode: EpisodeRecord, counted: Tally) -> float:
    """The longest common subsequence of done and expected, over expected.

    A ``single_search`` has nothing to order: its completeness.
    """
    if episode.task_type == _JUDGED_BY_NAME or not counted.expected:
        return completeness(counted)
    return _longest_common(counted.scored, counted.expected) / len(counted.expected)


def repeat_rate(episode: EpisodeRecord) -> float:
    """The share of navigations, failed ones too, that name a type navigated to before."""
    targets = [step.object_type for step in episode.steps if step.verb == NAVIGATE]
    return 1 - len(set(targets)) / len(targets) if targets else 0.0


def steps_saved(episode: EpisodeRecord) -> float:
    """(max_steps - steps) / max_steps, successful or not: another efficiency in circulation."""
    return (episode.max_steps - episode.num_steps) / episode.max_steps


def key_action_precision(episode: EpisodeRecord, counted: Tally) -> float:
    """Key actions done, navigations among them, over actions predicted (``init`` is none).

    The completeness of the paper's text; its scorer computes :func:`completeness`.
    """
    predicted = len(episode.predicted)
    return (counted.points + counted.routes) / predicted if predicted else 0.0


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
    """An episode's metrics under one scorer; each is the function of its name.

    Attributes:
        task_id, task_type, group: what was played.
        missing: the scoring key actions that were not done, as ``"verb Type"``.
    """

    task_id: str
    task_type: str
    group: str
    success: bool
    search_efficiency: float
    completeness: float
    ordered_completeness: float
    repeat_rate: float
    steps_saved: float
    key_action_precision: float
    missing: tuple[str, ...]


METRICS = (
    "success",
    "search_efficiency",
    "completeness",
    "ordered_completeness",
    "repeat_rate",
    "steps_saved",
    "key_action_precision",
)
"""The fields of :class:`Score` that are averaged, in the order in which reports give them."""


def score_episode(episode: EpisodeRecord, scorer: Scorer) -> Score:
    """All metrics of one episode."""
    counted = tally(episode, scorer)
    missing = Counter(counted.expected) - Counter(counted.scored)
    if counted.points > len(counted.scored):
        missing.pop(END, None)
    return Score(
        task_id=episode.task_id,
        task_type=episode.task_type,
        group=task_type(episode.task_type).group,
        success=success(counted),
        search_efficiency=search_efficiency(episode, counted),
        completeness=completeness(counted),
        ordered_completeness=ordered_completeness(episode, counted),
        repeat_rate=repeat_rate(episode),
        steps_saved=steps_saved(episode),
        key_action_precision=key_action_precision(episode, counted),
        missing=tuple(missing.elements()),
    )


@dataclass(frozen=True)
class Estimate:
    """A mean with its 95 % interval; ``low`` and ``high`` are None where n says nothing of it."""

    mean: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Summary:
    """The means over ``n`` episodes: one :class:`Estimate` for each of :data:`METRICS`."""

    n: int
    metrics: dict[str, Estimate]

    def __getitem__(self, metric: str) -> Estimate:
        return self.metrics[metric]


def wilson(successes: int, n: int) -> Estimate:
    """A rate of success with Wilson's score interval, which holds for rates near 0 and 1 too.

    Raises:
        ValueError: ``n`` is 0.
    """
    if n == 0:
        raise ValueError("no episodes: a rate needs at least one")
    rate = successes / n
    scale = 1 + _Z**2 / n
    centre = (rate + _Z**2 / (2 * n)) / scale
    half = _Z / scale * math.sqrt(rate * (1 - rate) / n + _Z**2 / (4 * n**2))
    # At the ends the interval touches 0 or 1, but for rounding.
    return Estimate(rate, max(centre - half, 0.0), min(centre + half, 1.0))


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


def summarise(scores: Sequence[Score]) -> Summary:
    """Means over episodes with 95 % intervals: Wilson's for success, the normal one for the rest.

    Raises:
        ValueError: there are no scores.
    """
    means = {metric: normal([getattr(each, metric) for each in scores]) for metric in METRICS[1:]}
    rate = wilson(sum(each.success for each in scores), len(scores))
    return Summary(len(scores), {"success": rate, **means})


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
