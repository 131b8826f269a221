"""The chapter of docs/validity.md on what success depends on besides the task.

The same tasks are played once more with one thing changed, and the two are compared task by task.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness.played import played
from benchmarks.harness.samples import sample_of_types
from benchmarks.scoring.metrics import Score, score_episode, summarise
from benchmarks.scoring.paired import paired_difference
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import interval, percent, signed
from er_gym.envs.protocol import DEFAULT, PROTOCOLS
from er_gym.envs.skills import Reachable, start_pose
from er_gym.rollout.records import EpisodeRecord
from er_gym.tables import Table, as_markdown
from er_gym.tasks.suites import own_tasks
from er_gym.tasks.task import AgentPose, Task
from er_gym.tasks.wordings.instructions import instruction, reworded

_SUITE = "er-1k"
_SCRIPTED = ("searcher", "mask-reader", "zoo:all")
_TEXT, _PICTURES = "zoo:er-tiny-text", "zoo:er-tiny-vl"
_LEARNT_FROM_PICTURES = ("pickup_and_put", "single_pickup", "single_search", "single_toggle")
"""The types that the model of pictures has learnt."""
_FAULTS = 0.1
_FAR = "default, from afar"


@dataclass(frozen=True)
class Way:
    """A way to play tasks.

    Attributes:
        name: of the way.
        told: the task as it is told.
        env: arguments of the environment.
        seed: of the run.
        settings: of a model agent.
    """

    name: str
    told: Callable[[Task], Task] = lambda task: reworded(task, "seen")
    env: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0
    settings: tuple[str, ...] = ()


def _told_again(task: Task) -> Task:
    """In a seen wording that is drawn once more, until it is another one."""
    first = reworded(task, "seen").instruction
    drawn = (instruction(task.name, f"{task.id} {k}", task.scene) for k in count())
    return replace(task, instruction=next(said for said in drawn if said and said != first))


def from_afar(bounds: Mapping[str, Any], floor: Reachable) -> AgentPose:
    """Another start: where one can stand furthest from the usual one, looking the other way."""
    usual = start_pose(bounds, floor)
    away = np.hypot(floor.positions[:, 0] - usual.x, floor.positions[:, 2] - usual.z)
    x, y, z = floor.positions[int(away.argmax())].tolist()
    return replace(usual, x=x, y=y, z=z, rotation=(usual.rotation + 180) % 360)


def _in_size(width: int, height: int) -> Way:
    said = (f"pictures.width={width}", f"pictures.height={height}")
    return Way(f"{width} × {height}", settings=said)


def _seeded(seed: int, faults: float) -> Way:
    name = f"{faults:.0%} faults" if faults else USUAL.name
    env = {"faults": faults} if faults else {}
    return Way(f"{name}, seed {seed}" if seed else name, env=env, seed=seed)


USUAL = Way("seen wording")
CHANGES = {
    "another seen wording": Way("another seen wording", _told_again),
    "an unseen wording": Way("unseen wording", lambda task: reworded(task, "unseen")),
    "Chinese": Way("Chinese", lambda task: reworded(task, "seen", "zh")),
    "another start": Way("another start", env={"protocol": _FAR}),
}
SIZES = (_in_size(224, 126), _in_size(448, 252), _in_size(896, 504))
"""The second is that of its training."""
SEEDS: Sequence[tuple[str, float, int]] = (
    ("random", 0.0, 5),
    *((agent, *draws) for agent in _SCRIPTED for draws in ((0.0, 2), (_FAULTS, 5))),
)
"""Agents, the rate of faults, and how many seeds are played."""

Found = Mapping[tuple[str, str], Sequence[EpisodeRecord]]
"""Agent and name of the way to the episodes."""


def plays(
    work: Path, each: int, of_models: int
) -> Iterator[tuple[tuple[str, str], list[EpisodeRecord]]]:
    """All episodes of the chapter.

    Args:
        work: where they are kept.
        each: tasks of a type.
        of_models: the same for language models.
    """
    PROTOCOLS.setdefault(_FAR, replace(DEFAULT, name=_FAR, start=from_afar))
    for agent, way, types, number in _plan(each, of_models):
        tasks = sample_of_types(own_tasks(_SUITE), types, number)
        # The oracle means the task's own objects, so elsewhere it fails from any start.
        env = {"instances": "target" if agent == "oracle" else "explore", **way.env}
        yield (agent, way.name), played(
            work, way.name, agent, [way.told(task) for task in tasks],
            env=env, seed=way.seed, settings=way.settings,
        )  # fmt: skip


def number_of_plays() -> int:
    """How many :func:`plays` yields."""
    return len([*_plan(1, 1)])


def _plan(each: int, of_models: int) -> Iterator[tuple[str, Way, tuple[str, ...], int]]:
    """Agent, way, types and number of tasks of each."""
    for agent in _SCRIPTED:
        for way in (USUAL, *CHANGES.values()):
            yield agent, way, (), each
    for way in (USUAL, CHANGES["another start"]):
        yield "oracle", way, (), each
    for agent, faults, seeds in SEEDS:
        for seed in range(seeds):
            yield agent, _seeded(seed, faults), (), each
    for way in (USUAL, *CHANGES.values()):
        yield _TEXT, way, (), of_models
    for way in SIZES:  # of its few types twice as many tasks of each
        yield _PICTURES, way, _LEARNT_FROM_PICTURES, 2 * of_models


def chapter(found: Found) -> str:
    """The chapter, without its heading."""
    seconds = [(what, way.name) for what, way in CHANGES.items()]
    agents = (*_SCRIPTED, _TEXT)
    rows = [(what, agent, USUAL.name, name) for what, name in seconds for agent in agents]
    rows.append(("another start", "oracle", USUAL.name, CHANGES["another start"].name))
    small, usual, large = (way.name for way in SIZES)
    rows += [(f"{name} pixels", _PICTURES, usual, name) for name in (small, large)]
    return "\n".join(
        (
            as_markdown([_changes(found, rows)]),
            _CHANGES,
            as_markdown([_seeds(found)]),
            _SEEDED,
        )
    )


def _changes(found: Found, rows: Sequence[tuple[str, str, str, str]]) -> Table:
    """What each change does to success; rows are change, agent and the names of two ways."""
    lines = []
    for what, agent, first, second in rows:
        before, after = _scores(found[agent, first]), _scores(found[agent, second])
        pairs = [(one.success, other.success) for one, other in zip(before, after, strict=True)]
        lines.append(
            (
                what,
                agent,
                str(len(pairs)),
                *(percent(summarise(each)["success"].mean, 1) for each in (before, after)),
                *signed(paired_difference(before, after)),
                str(pairs.count((False, True))),
                str(pairs.count((True, False))),
            )
        )
    head = ("Change", "Agent", "n", "Before", "After", "Difference", "95 %", "Gained", "Lost")
    return Table("One thing changed, the same tasks: success in %", head, tuple(lines), 2)


def _seeds(found: Found) -> Table:
    """How much success differs between seeds, beside what the number of tasks leaves open."""
    lines = []
    for agent, faults, seeds in SEEDS:
        runs = [found[agent, _seeded(seed, faults).name] for seed in range(seeds)]
        rates = [summarise(_scores(run))["success"].mean for run in runs]
        n, mean = len(runs[0]), statistics.fmean(rates)
        acted = [{_actions(each) for each in records} for records in zip(*runs, strict=True)]
        lines.append(
            (
                agent,
                f"{faults:.0%}" if faults else "none",
                str(n),
                str(seeds),
                percent(mean, 1),
                f"{percent(min(rates), 1)} to {percent(max(rates), 1)}",
                percent(statistics.stdev(rates), 1),
                percent(math.sqrt(mean * (1 - mean) / n), 1),
                interval(summarise(_scores(runs[0]))["success"]),
                str(sum(len(each) == 1 for each in acted)),
            )
        )
    head = (
        *("Agent", "Faults", "n", "Seeds", "Success", "Lowest to highest"),
        *("Deviation between seeds", "Deviation of a binomial", "95 % of seed 0", "Same actions"),
    )
    return Table("Several seeds, the same tasks: success in %", head, tuple(lines), 2)


def _scores(records: Sequence[EpisodeRecord]) -> list[Score]:
    return [score_episode(each, CORRECTED) for each in records]


def _actions(record: EpisodeRecord) -> tuple[tuple[str, str], ...]:
    return tuple((step.verb, step.object_id or step.object_type) for step in record.steps)


_CHANGES = """\
Each row plays the same tasks of `er-1k` twice, with `instances="explore"`: *before* in a seen
wording and from the usual start, *after* with one thing changed. The difference is paired over the
tasks. *Gained* and *lost* are the tasks that came out otherwise; where there are none, the interval
says nothing, and at most three in n would come out otherwise, at 95 %.

*Another start* is where one can stand furthest from the usual one, looking the other way; the
oracle, with `instances="target"`, shows what can be done from there. `searcher`, `mask-reader` and
`zoo:all` read words and lists, so the size of pictures is nothing to them. `zoo:er-tiny-vl` has
learnt four types of tasks from pictures of 448 × 252 pixels; it scales what it is shown to 66,000
pixels at most, so the largest pictures are only sharper to it. No language model here has learnt
from instructions in Chinese.
"""
_SEEDED = """\
The seed draws the faults, and what an agent draws that draws at all. `searcher`, `mask-reader` and
`zoo:all` do not, and language models say what is most probable: without faults, each plays a task
always alike. *Same actions* counts the tasks in which all seeds did the same. The deviation between
seeds is that of success in the same tasks. A binomial's, √(p(1 − p)/n), is what a sample of n tasks
leaves open, from which the intervals of all pages are made.
"""
