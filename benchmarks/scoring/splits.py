"""Success by how new a task is: its room, its objects, its wording."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from benchmarks.scoring.metrics import Score, Summary, summarise
from benchmarks.scoring.report import RunReport
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import interval, percent
from er_gym.rollout.records import EpisodeRecord
from er_gym.tables import Table
from er_gym.tasks.splits import is_about, is_strictly_unseen, split_of
from er_gym.tasks.task import type_of_id
from er_gym.tasks.wordings.instructions import wording_of

SPLITS = ("seen", "unseen object", "unseen room", "unseen room and object")
"""From the least to the most new."""
STRICT = "strictly unseen object"
"""A part of the unseen objects: those that stand in none of the rooms ``strict``."""
WORDINGS = {"seen": "seen wording", "unseen": "unseen wording"}
"""The same episodes once more, by their instructions, those that are in a wording of er-gym."""


def split_of_episode(episode: EpisodeRecord) -> str:
    """How new an episode's task is, one of :data:`SPLITS`."""
    return split_of(episode.scene, _subjects(episode))


def splits_of_episode(episode: EpisodeRecord) -> tuple[str, ...]:
    """All rows in which an episode counts: one of :data:`SPLITS`, :data:`STRICT`, one of
    :data:`WORDINGS`."""
    strict = (STRICT,) if is_strictly_unseen(_subjects(episode)) else ()
    said = wording_of(episode.name, episode.instruction)
    return (split_of_episode(episode), *strict, *((WORDINGS[said],) if said else ()))


def _subjects(episode: EpisodeRecord) -> set[str]:
    found = {
        type_of_id(key.object_id) or key.object_type
        for key in episode.key_actions
        if is_about(key.verb)
    }
    return found or set(episode.search_targets or ())


@dataclass(frozen=True)
class SplitResult:
    """The success of a run on the tasks of one split.

    Attributes:
        suite, agent: of the run.
        split: one of :data:`SPLITS`, :data:`STRICT`, or one of :data:`WORDINGS`.
        summary: by the corrected scorer.
    """

    suite: str
    agent: str
    split: str
    summary: Summary


def split_results(reports: Iterable[RunReport]) -> list[SplitResult]:
    """The splits of each run in order, those that it has tasks of."""
    found = []
    for report in reports:
        by_split: dict[str, list[Score]] = {}
        for episode, score in zip(report.episodes, report.scores[CORRECTED.name], strict=True):
            for name in splits_of_episode(episode):
                by_split.setdefault(name, []).append(score)
        found += [
            SplitResult(report.manifest.suite, report.manifest.agent, name, summarise(scores))
            for name in (*SPLITS, STRICT, *WORDINGS.values())
            if (scores := by_split.get(name))
        ]
    return found


def split_table(results: Sequence[SplitResult]) -> Table:
    """The results as a table."""
    return Table(
        title="How new the tasks are, success in %",
        head=("suite", "agent", "tasks", "n", "success", "95 %", "SE", "TC"),
        rows=tuple(
            (
                each.suite,
                each.agent,
                each.split,
                str(each.summary.n),
                percent(each.summary["success"].mean, 1),
                interval(each.summary["success"]),
                percent(each.summary["search_efficiency"].mean, 1),
                percent(each.summary["completeness"].mean, 1),
            )
            for each in results
        ),
        text_columns=3,
        notes=(
            "seen: rooms and objects of the training tasks; unseen object: a type that no training "
            "task searches for, picks up or switches, though it stands in training rooms; strictly "
            "unseen: it stands in none of the rooms strict",
            "unseen wording: a part of the instruction is in no training task, or a name in it",
            "SE: search efficiency; TC: task completeness",
        ),
    )
