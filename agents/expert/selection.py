"""Rejection sampling: which episodes of earlier runs become trajectories.

As in the paper's second stage (arXiv 2503.21696), each task is played several times
(``er-gym bench --samples``), and successful episodes are kept. An episode is a success if the
environment said so and its judge confirms it from the record.
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import ceil, floor
from typing import Any, Literal

from agents.expert.acceptance import steps_of
from agents.expert.candidates import Candidate, FixedCandidates
from agents.expert.collect import Stratum
from agents.expert.explorer import Strength
from agents.expert.recipe import Part, Recipe, quotas
from agents.expert.recorded_replies import recorded_replies
from agents.expert.replayed import PLAYED
from er_gym.rollout.judgement import judged
from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks import verbs
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME

SAMPLED = "sampled"
"""The part of a collection that holds selected episodes."""
RECIPE: Literal["recipe"] = "recipe"
MOST_ACTIONS = 36
"""The paper's longest step limit."""
RAREST = 30.0
"""The paper's explored trajectories have 29 times as many of the most frequent type as of the
rarest (1,944 and 66)."""

NO_SUCCESS, CRASHED = "no success", "crashed"
SCORER = "the judge finds no success in the record"
UNREADABLE, FAILED = "a reply names no action", "an action failed"
NO_END = "it did not say end"
TOO_LONG, TOO_MANY_TOKENS = "too long", "too many tokens"
NO_CONVERSATION = "its conversation cannot be read"
DUPLICATE = "the same actions"
PER_TASK, BALANCE, LIMIT = "enough of its task", "enough of its type", "enough in all"


@dataclass(frozen=True)
class SelectionRules:
    """Which successes are taken.

    Attributes:
        most_actions: longer episodes are not taken.
        most_tokens: conversations with more tokens, as the model counted them, are not taken; None
            for any number. Agents without conversations have no tokens.
        per_task: at most so many episodes of a task; None for any number.
        balance: at most so many times as many of a task type as of the rarest that succeeded at
            all; ``"recipe"``: in the proportions of a recipe; None for as many as there are.
        keep_failed: whether episodes with failed actions are taken; their failed turns are not
            learnt from.
    """

    most_actions: int = MOST_ACTIONS
    most_tokens: int | None = None
    per_task: int | None = None
    balance: float | Literal["recipe"] | None = RAREST
    keep_failed: bool = False


@dataclass
class TypeYield:
    """The numbers of samples of one task type that were played, successful and kept.

    Attributes:
        tasks: how many tasks were played, and ``solved``: of how many a sample succeeded.
        played, succeeded: numbers of samples.
        kept: how many are in the collection.
        left_out: how many are not, by the reason; these and ``kept`` sum to ``played``.
    """

    tasks: int = 0
    solved: int = 0
    played: int = 0
    succeeded: int = 0
    kept: int = 0
    left_out: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class _Success:
    """An episode that may be taken, as far as it decides which are."""

    run: int
    sample: int
    key: str
    seed: int
    course: bytes


@dataclass
class Screening:
    """What :func:`screen` found.

    Attributes:
        candidates: the episodes that may be taken, by task type, in the order of their choice.
        yields: by task type, in the order of the table of types.
    """

    candidates: dict[str, list[Candidate]]
    yields: dict[str, TypeYield]


def screen(
    runs: Sequence[RunDirectory], tasks: Iterable[Task], rules: SelectionRules, seed: int
) -> Screening:
    """Find the episodes of some runs that may be taken; they are read one at a time.

    Memory grows by some hundred bytes for each success.

    Args:
        runs: of the same tasks, in the same environment.
        tasks: those that are wanted; episodes of others are passed over.
        rules: what is taken.
        seed: of the order.
    """
    by_id = {task.id: task for task in tasks}
    yields: defaultdict[str, TypeYield] = defaultdict(TypeYield)
    found: defaultdict[str, list[_Success]] = defaultdict(list)
    played: set[str] = set()
    solved: set[str] = set()
    for number, run in enumerate(runs):
        for episode in run.episodes():
            task = by_id.get(episode.task_id)
            if task is None:
                continue
            row = yields[task.type.name]
            row.played += 1
            played.add(task.id)
            reason = _failure(episode)
            if not reason:
                row.succeeded += 1
                solved.add(task.id)
                reason = _unfitness(episode, run, rules)
            if reason:
                row.left_out[reason] += 1
                continue
            found[task.id].append(
                _Success(number, episode.sample, episode.key, episode.seed, _course(episode))
            )
    for ids, name in ((played, "tasks"), (solved, "solved")):
        for task_id in ids:
            row = yields[by_id[task_id].type.name]
            setattr(row, name, getattr(row, name) + 1)
    candidates: defaultdict[str, list[tuple[int, Candidate]]] = defaultdict(list)
    for task_id, successes in found.items():
        task = by_id[task_id]
        different = _different(successes, rules, yields[task.type.name].left_out)
        candidates[task.type.name] += [
            (rank, _candidate(task, each, runs)) for rank, each in enumerate(different)
        ]
    in_order = {
        name: [
            one for _, one in sorted(pairs, key=lambda pair: (pair[0], _drawn(seed, pair[1].id)))
        ]
        for name, pairs in candidates.items()
    }
    names = [*BY_NAME, *sorted(yields.keys() - BY_NAME.keys())]
    return Screening(
        {name: in_order[name] for name in names if name in in_order},
        {name: yields[name] for name in names if name in yields},
    )


def _failure(episode: EpisodeRecord) -> str:
    """Why an episode is no success, ``""`` if it is one."""
    if episode.error:
        return CRASHED
    if not episode.success:
        return NO_SUCCESS
    return "" if judged(episode).success else SCORER


def _unfitness(episode: EpisodeRecord, run: RunDirectory, rules: SelectionRules) -> str:
    """Why a success is not taken, ``""`` if it may be."""
    steps = steps_of(episode)
    if any(step.verb == ERROR for step in steps):
        return UNREADABLE
    if not rules.keep_failed and not all(step.success for step in steps):
        return FAILED
    if not steps or steps[-1].verb != verbs.END:
        return NO_END
    if len(steps) > rules.most_actions:
        return TOO_LONG
    try:
        words = recorded_replies(run.path, episode)
    except ValueError:
        return NO_CONVERSATION
    if words is not None and rules.most_tokens is not None and words.tokens > rules.most_tokens:
        return TOO_MANY_TOKENS
    return ""


def _course(episode: EpisodeRecord) -> bytes:
    """16 bytes that stand for the actions of an episode."""
    actions = "\n".join(f"{step.verb} {step.object_type}" for step in steps_of(episode))
    return hashlib.blake2b(actions.encode(), digest_size=16).digest()


def _different(
    successes: Sequence[_Success], rules: SelectionRules, left_out: Counter[str]
) -> list[_Success]:
    """The first successes of a task with different actions."""
    kept: dict[bytes, _Success] = {}
    for each in sorted(successes, key=lambda one: (one.run, one.sample)):
        if each.course in kept:
            left_out[DUPLICATE] += 1
        elif rules.per_task is not None and len(kept) >= rules.per_task:
            left_out[PER_TASK] += 1
        else:
            kept[each.course] = each
    return [*kept.values()]


def _candidate(task: Task, success: _Success, runs: Sequence[RunDirectory]) -> Candidate:
    run = runs[success.run]
    return Candidate(
        id=f"{success.key}-{SAMPLED}{success.run + 1 if success.run else ''}",
        part=SAMPLED,
        actor=run.manifest.agent,
        task=task,
        index=0,
        kind=PLAYED,
        run=str(run.path),
        episode=success.key,
        seed=success.seed,
    )


def _drawn(seed: int, name: str) -> bytes:
    return hashlib.sha256(f"{seed}/{name}".encode()).digest()


# -- how many of each type -------------------------------------------------------------------------


def selection_strata(
    screening: Screening, rules: SelectionRules, recipe: Recipe, limit: int | None
) -> dict[tuple[str, str], Stratum]:
    """The candidates by part and task type, and how many of each are wanted.

    Candidates beyond the number of a type take the place of those whose replay differs. First come
    the first successes of all tasks, then the second ones.

    Args:
        screening: what there is.
        rules: with the balance.
        recipe: for ``balance="recipe"``: its explorers' part, or all of its parts.
        limit: how many in all; None for as many as may be.
    """
    there = {name: len(candidates) for name, candidates in screening.candidates.items()}
    factor = rules.balance
    if factor == RECIPE:
        wanted = _in_proportion(there, recipe, limit)
    else:
        wanted = _level(_capped(there, factor), limit)
    return {
        (SAMPLED, name): Stratum(FixedCandidates(candidates), wanted.get(name, 0))
        for name, candidates in screening.candidates.items()
    }


def _capped(there: Mapping[str, int], factor: float | None) -> dict[str, int]:
    if factor is None or not there:
        return dict(there)
    most = ceil(factor * min(there.values()))
    return {name: min(number, most) for name, number in there.items()}


def _level(there: Mapping[str, int], limit: int | None) -> dict[str, int]:
    """At most ``limit`` in all: as many of each type, or all of a type that has fewer.

    With a larger limit no number is smaller.
    """
    if limit is None or sum(there.values()) <= limit:
        return dict(there)
    level = 0
    while sum(min(number, level + 1) for number in there.values()) <= limit:
        level += 1
    wanted = {name: min(number, level) for name, number in there.items()}
    left = limit - sum(wanted.values())
    for name in [name for name, number in there.items() if number > level][:left]:
        wanted[name] += 1
    return wanted


def _in_proportion(there: Mapping[str, int], recipe: Recipe, limit: int | None) -> dict[str, int]:
    """As many as there can be in the proportions of a recipe; types that it lacks are left out."""
    shares = explored_shares(recipe)
    possible = [number / shares[name] for name, number in there.items() if shares.get(name)]
    if not possible:
        return {}
    most = max(1, floor(min(possible) * sum(shares[name] for name in there if shares.get(name))))
    asked = Recipe(parts={SAMPLED: _part(shares, MOST_ACTIONS)})
    number = most if limit is None else min(limit, most)
    wanted = {name: count for (_, name), count in quotas(asked, number, set(there)).items()}
    return {name: min(count, there[name]) for name, count in wanted.items()}


def explored_shares(recipe: Recipe) -> dict[str, int]:
    """The numbers by task type of a recipe's explorers, or of all its parts if it has none."""
    parts = [part for part in recipe.parts.values() if part.actor == "explorer"]
    shares: Counter[str] = Counter()
    for part in parts or recipe.parts.values():
        shares.update(part.types)
    return {name: number for name, number in shares.items() if number}


def selection_recipe(rules: SelectionRules) -> Recipe:
    """The recipe of a collection of selected episodes: one part, whatever the task types."""
    return Recipe(parts={SAMPLED: _part(dict.fromkeys(BY_NAME, 1), rules.most_actions)})


def _part(types: dict[str, int], most_actions: int) -> Part:
    return Part(
        actor="explorer",
        types=types,
        explorers={"run": Strength()},
        direct=1.0,
        most_actions=most_actions,
    )


# -- what became of them ---------------------------------------------------------------------------


def count_kept(
    screening: Screening,
    strata: Mapping[tuple[str, str], Stratum],
    why_not: Callable[[Candidate], str],
    limited: bool,
) -> dict[str, TypeYield]:
    """The yields, with what was kept and why the rest was not.

    Args:
        screening: whose yields they are; it is not changed.
        strata: after collecting.
        why_not: why a candidate that was played again was not taken.
        limited: whether there was a limit in all.
    """
    found = {}
    for name, row in screening.yields.items():
        stratum = strata.get((SAMPLED, name))
        left_out = Counter(row.left_out)
        kept = 0
        if stratum is not None:
            taken = {one.id for one in stratum.taken}
            kept = len(taken)
            candidates = screening.candidates[name]
            for one in candidates[: stratum.looked_at]:
                if one.id not in taken:
                    left_out[why_not(one)] += 1
            beyond = len(candidates) - stratum.looked_at
            if beyond:
                left_out[LIMIT if limited else BALANCE] += beyond
        found[name] = TypeYield(row.tasks, row.solved, row.played, row.succeeded, kept, left_out)
    return found


def yield_record(
    runs: Sequence[Mapping[str, Any]], yields: Mapping[str, TypeYield]
) -> dict[str, Any]:
    """The yields as JSON holds them: ``yield.json`` of a collection.

    Args:
        runs: what to say of the runs.
        yields: by task type.
    """
    return {
        "format": "er-gym/yield/1",
        "runs": [*runs],
        "types": {
            name: {**vars(row), "left_out": dict(sorted(row.left_out.items()))}
            for name, row in yields.items()
        },
    }
