"""One or several run directories, scored and laid out for reading or for other programs."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from benchmarks.scoring.metrics import (
    IF_TOLD,
    METRICS,
    Estimate,
    Score,
    Summary,
    score_episode,
    success_rate,
    summarise,
    summarise_by,
)
from benchmarks.scoring.samples import (
    TaskSamples,
    arrangement_of,
    group_by,
    most_samples,
    task_samples,
)
from benchmarks.scoring.scorers import CORRECTED, PAPER, SCORERS
from er_gym.rollout.causes import CauseCount, causes_in, count_causes
from er_gym.rollout.judgement import lacks_search_targets
from er_gym.rollout.records import EpisodeRecord, episode_key
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tables import Table
from er_gym.tasks.errors import describe_substitutions
from er_gym.tasks.suites import suite_version
from er_gym.tasks.types import BY_NAME, GROUPS

BOTH = "both"
"""The choice that shows both scorers where they differ, and one line where they agree."""

SCORER_CHOICES = (BOTH, *SCORERS)


@dataclass(frozen=True)
class Miss:
    """An episode that failed under the ``corrected`` scorer, and why.

    Attributes:
        task_id, task_type, scene: what was played; a later sample has its number in the id.
        end_reason: why the episode ended, ``"crashed"`` if it crashed.
        feedback: the error, why the agent gave up, or what it was told last.
        missing: the key actions that were not done, as ``"verb Type"``.
    """

    task_id: str
    task_type: str
    scene: str
    end_reason: str
    feedback: str
    missing: tuple[str, ...]


@dataclass(frozen=True)
class RunReport:
    """A run directory's episodes and their scores.

    Attributes:
        path: the directory.
        manifest: what was played.
        episodes: in the order of their file names.
        unusable: descriptions of other files among them, which are not counted.
        scores: for each scorer's name, one score per episode, in the same order.
    """

    path: Path
    manifest: Manifest
    episodes: tuple[EpisodeRecord, ...]
    scores: dict[str, tuple[Score, ...]]
    unusable: tuple[str, ...] = ()

    @property
    def differ(self) -> tuple[str, ...]:
        """The ids of the tasks that the scorers score differently; later samples have their number
        in the id."""
        pairs = zip(self.scores[PAPER.name], self.scores[CORRECTED.name], strict=True)
        return tuple(
            episode_key(paper.task_id, paper.sample)
            for paper, corrected in pairs
            if any(getattr(paper, name) != getattr(corrected, name) for name in METRICS)
        )

    @property
    def misses(self) -> tuple[Miss, ...]:
        """Every episode without success, and why."""
        pairs = zip(self.episodes, self.scores[CORRECTED.name], strict=True)
        return tuple(_miss(episode, each) for episode, each in pairs if not each.success)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Sentences about what the figures do not count, and about objects that replaced missing
        ones.
        """
        aside = [
            f"{len(self.manifest.set_aside)} of the suite's tasks set aside and not counted"
        ] * bool(self.manifest.set_aside)
        return (
            *aside,
            *(f"set aside: {one}" for one in self.manifest.set_aside),
            *describe_substitutions(self.manifest.taken),
            *(f"not counted: {one}" for one in self.unusable),
        )

    @property
    def crashed(self) -> int:
        """How many episodes crashed; the same command as before plays them again."""
        return sum(bool(episode.error) for episode in self.episodes)

    @property
    def causes(self) -> list[CauseCount]:
        """The causes of unusable replies, as the records name them."""
        return count_causes(map(causes_in, self.episodes))

    @property
    def causes_in_words(self) -> tuple[str, ...]:
        """The same, each in a line with what to do."""
        return tuple(each.sentence(self.manifest.agent_settings) for each in self.causes)

    @property
    def without_targets(self) -> int:
        """How many searches have records that do not say what is searched for."""
        return sum(map(lacks_search_targets, self.episodes))

    def shown(self, scorer: str) -> dict[str, tuple[Score, ...]]:
        """The scores to show for a choice of :data:`SCORER_CHOICES`, by the name to show."""
        if scorer != BOTH:
            return {scorer: self.scores[scorer]}
        if not self.differ:
            return {BOTH: self.scores[CORRECTED.name]}
        return self.scores


@dataclass(frozen=True)
class BetweenArrangements:
    """Success with the interval that other arrangements of the same rooms would give.

    Tasks of one arrangement fail together where it hides a thing well, so this interval is usually
    wider than one that counts tasks as independent.

    Attributes:
        arrangements: how many different ones were played.
        success: with Wilson's interval, for the number of episodes in different arrangements that
            would tell as much.
    """

    arrangements: int
    success: Estimate


def between_arrangements(
    episodes: Sequence[EpisodeRecord], scores: Sequence[Score]
) -> BetweenArrangements | None:
    """Success by arrangement; None if no two tasks share one, or all do.

    Args:
        episodes, scores: (n,) what was played, and what it scored.
    """
    where = [arrangement_of(episode.scene, episode.task_id) for episode in episodes]
    different = len(set(where))
    if different < 2 or different == len({each.task_id for each in scores}):
        return None
    return BetweenArrangements(different, success_rate(where, [each.success for each in scores]))


def load_run(path: Path) -> RunReport:
    """Read and score a run directory.

    Raises:
        RunDirectoryError: the directory holds no run.
    """
    run_directory = RunDirectory.open(path)
    found = run_directory.read()
    scores = {
        name: tuple(score_episode(episode, scorer) for episode in found.episodes)
        for name, scorer in SCORERS.items()
    }
    unusable = tuple(map(str, found.unusable))
    return RunReport(path, run_directory.manifest, found.episodes, scores, unusable)


def _miss(episode: EpisodeRecord, scored: Score) -> Miss:
    last = episode.steps[-1].feedback if episode.steps else ""
    return Miss(
        task_id=episode.key,
        task_type=episode.task_type,
        scene=episode.scene,
        end_reason="crashed" if episode.error else episode.end_reason,
        feedback=" ".join((episode.error or episode.gave_up or last).split()),
        missing=scored.missing,
    )


def _parts(scores: Sequence[Score]) -> list[tuple[str, str, Sequence[Score]]]:
    """(level, name, scores) overall, for each group and for each task type that was played, in the
    order of the paper's table and of the table of task types."""
    groups = group_by(scores, lambda each: each.group)
    types = group_by(scores, lambda each: each.task_type)
    return [
        *([("overall", "all", scores)] if scores else []),
        *(("group", name, groups[name]) for name in GROUPS if name in groups),
        *(("type", name, types[name]) for name in BY_NAME if name in types),
    ]


def slices(scores: Sequence[Score]) -> list[tuple[str, str, Summary]]:
    """(level, name, summary) overall, for each group and for each task type that was played."""
    return [(level, name, summarise(part)) for level, name, part in _parts(scores)]


def sample_slices(scores: Sequence[Score]) -> list[tuple[str, str, TaskSamples]]:
    """(level, name, samples) as :func:`slices`; empty if no task was played several times."""
    samples = most_samples(scores)
    if samples < 2:
        return []
    found = [(level, name, task_samples(part, samples)) for level, name, part in _parts(scores)]
    return [(level, name, counted) for level, name, counted in found if counted is not None]


def by_group(scores: Sequence[Score]) -> dict[str, Summary]:
    """Summaries of the groups that were played, in the order of the paper's table."""
    return summarise_by(scores, lambda each: each.group, GROUPS)


def as_json(runs: Sequence[RunReport]) -> str:
    """Everything: manifests with the tasks that were set aside, means and intervals of every slice,
    scores of every episode, and misses.
    """
    return json.dumps({"format": "er-gym/report/1", "runs": [_run(run) for run in runs]}, indent=2)


def _run(run: RunReport) -> dict[str, Any]:
    return {
        "path": str(run.path),
        "protocol": run.manifest.protocol,
        "manifest": run.manifest.model_dump(),
        "suite_version": suite_version(run.manifest.suite, run.manifest.suite_digest),
        "episodes": len(run.episodes),
        "crashed": run.crashed,
        "causes": [
            {**dataclasses.asdict(each), "in_words": words}
            for each, words in zip(run.causes, run.causes_in_words, strict=True)
        ],
        "not_counted": run.unusable,
        "scorers_differ": run.differ,
        "scorers": {
            name: {
                "version": SCORERS[name].version,
                "slices": [
                    {
                        "level": level,
                        "name": part,
                        "n": summary.n,
                        **{key: dataclasses.asdict(summary[key]) for key in METRICS},
                        **{
                            key: dataclasses.asdict(told)
                            for key in IF_TOLD
                            if (told := summary.get(key)) is not None
                        },
                    }
                    for level, part, summary in slices(scores)
                ],
                **_samples(scores),
                **_between(between_arrangements(run.episodes, scores)),
                "episodes": [_score(each) for each in scores],
            }
            for name, scores in run.scores.items()
        },
        "misses": [dataclasses.asdict(miss) for miss in run.misses],
    }


def _score(score: Score) -> dict[str, Any]:
    told = dataclasses.asdict(score)
    plain = {"sample": 1, **dict.fromkeys(IF_TOLD)}
    return {key: each for key, each in told.items() if key not in plain or each != plain[key]}


def _samples(scores: Sequence[Score]) -> dict[str, Any]:
    found = [
        {"level": level, "name": name, **dataclasses.asdict(counted)}
        for level, name, counted in sample_slices(scores)
    ]
    return {"samples": found} if found else {}


def _between(found: BetweenArrangements | None) -> dict[str, Any]:
    return {} if found is None else {"between_arrangements": dataclasses.asdict(found)}


def _cells(estimate: Estimate | None) -> tuple[float | None, ...]:
    return (None, None, None) if estimate is None else dataclasses.astuple(estimate)


def as_csv(runs: Sequence[RunReport], scorer: str = BOTH, with_types: bool = False) -> str:
    """One line per run, scorer and slice (overall and groups; task types if asked for).

    Rates are fractions; a missing interval is empty, and so is what older records do not tell. A
    task that was set aside, or an object that stands for one that a scene lacks, has a line without
    figures; so does a file that is not an episode, and a cause that records name.
    """
    metrics = (*METRICS, *IF_TOLD)
    columns = [f"{metric}{end}" for metric in metrics for end in ("", "_low", "_high")]
    rows: list[tuple[object, ...]] = []
    for run in runs:
        manifest = run.manifest
        head = (run.path, manifest.agent, manifest.suite, manifest.protocol)
        for name, scores in run.shown(scorer).items():
            for level, part, summary in slices(scores):
                if level == "type" and not with_types:
                    continue
                estimates = (_cells(summary.get(name)) for name in metrics)
                rows.append((*head, name, level, part, summary.n, *chain(*estimates)))
        for level, lines in (
            ("set aside", map(str, run.manifest.set_aside)),
            ("taken", describe_substitutions(run.manifest.taken)),
            ("not counted", run.unusable),
            ("cause", run.causes_in_words),
        ):
            rows += ((*head, "", level, line, 0, *[""] * len(columns)) for line in lines)
    told = ("run", "agent", "suite", "protocol", "scorer", "level", "name", "n", *columns)
    cells = (tuple("" if cell is None else str(cell) for cell in row) for row in rows)
    return Table("", told, tuple(cells), 7).csv()
