"""What the pages say of a collection, and of one of its trajectories."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from benchmarks.monitor.charts import as_svg, round_ticks
from benchmarks.monitor.collection_index import CollectionIndex, TrajectoryHead
from benchmarks.monitor.flow import flow
from benchmarks.monitor.language import Translator
from benchmarks.monitor.listing import TaskFilter
from benchmarks.scoring.series import Axis, Chart, Series, points
from er_gym.data import paper_figures as paper
from er_gym.data.statistics import STATES, mean_and_most
from er_gym.data.trajectory import TAG_OF_KIND, THOUGHT_KINDS, PictureRecord, Trajectory, Turn
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.tasks.verbs import INIT

SORTS: Mapping[str, Callable[[TrajectoryHead], Any]] = {
    "order": lambda head: head.offset,
    "turns": lambda head: (head.turns, head.offset),
    "thoughts": lambda head: (head.thoughts, head.offset),
    "refused": lambda head: (len(head.refused), head.offset),
}
"""What trajectories can be sorted by; ``order`` is the file's."""


@dataclass(frozen=True)
class DataFilter(TaskFilter[TrajectoryHead]):
    """Which trajectories of a collection are shown.

    Attributes:
        part, kind, language, outcome: exact values; "" for any.
        refused: a code of the critic's; "" for any.
    """

    sorts: ClassVar[Mapping[str, Callable[[TrajectoryHead], Any]]] = SORTS

    part: str = ""
    kind: str = ""
    language: str = ""
    outcome: str = ""
    refused: str = ""
    sort: str = "order"

    def takes(self, row: TrajectoryHead) -> bool:
        """Whether a trajectory is shown."""
        exact = {
            "part": row.part,
            "kind": row.kind,
            "language": row.language,
            "outcome": outcome_of(row),
        }
        matches = self.matches(row.task_type, exact, f"{row.id} {row.instruction}")
        return matches and (not self.refused or self.refused in row.refused)


def outcome_of(head: TrajectoryHead) -> str:
    """``success`` or ``failure``."""
    return "success" if head.success else "failure"


@dataclass(frozen=True)
class Count:
    """A count: of what, how many, its share of all, and the paper's share; None for none."""

    name: str
    n: int
    share: float
    paper: float | None = None


def counted(counts: Mapping[str, int], papers: Mapping[str, int] | None = None) -> list[Count]:
    """Counts with their shares, the greatest first."""
    every, theirs = sum(counts.values()), sum((papers or {}).values())
    return [
        Count(name, n, n / every, papers[name] / theirs if papers and name in papers else None)
        for name, n in sorted(counts.items(), key=lambda one: (-one[1], one[0]))
        if n
    ]


def overview(index: CollectionIndex, t: Translator) -> dict[str, Any]:
    """The counts and pictures of a collection's page."""
    heads, found = index.heads, index.found
    states = {state: t.name(f"state_{state}") for state in STATES}
    longest = max(index.lengths, default=1)
    lengths = [(float(n), float(index.lengths[n])) for n in range(1, longest + 1)]
    whole = [each for each in round_ticks(0.0, max(n for _, n in lengths)) if each == int(each)]
    return {
        "parts_counted": counted(Counter(head.part for head in heads)),
        "kinds": counted(Counter(head.kind for head in heads)),
        "types": counted(found.task_types, paper.TASK_TYPES),
        "languages": counted(found.languages),
        "actors": counted(Counter(head.actor for head in heads)),
        "thoughts": [
            Count(
                kind,
                found.thoughts[kind],
                found.thoughts[kind] / max(1, found.all_thoughts),
                paper.THOUGHTS[kind] / sum(paper.THOUGHTS.values()),
            )
            for kind in THOUGHT_KINDS
        ],
        "refusals": counted(found.refused),
        "succeeded": sum(head.success for head in heads),
        "shares": found.transition_shares(),
        "papers": paper.TRANSITIONS,
        "states": STATES,
        "mean_turns": mean_and_most(index.lengths)[0],
        "flow": flow(
            "flow", t("what_follows"), found.transitions, states, (t("after_this"), t("comes_this"))
        ),
        "lengths": as_svg("lengths", Chart(
            t("by_turns"), Axis(t("turns"), low=0.0, high=longest + 1.0),
            Axis(t("trajectories"), low=0.0, at=whole),
            [Series(t("trajectories"), points(lengths), "bars")],
        )) if heads else "",
    }  # fmt: skip


@dataclass(frozen=True)
class TurnView:
    """A turn of a trajectory.

    Attributes:
        number: from 0.
        turn: as the trajectory has it.
        tags: the CSS class of each thought.
        pictures: the numbers of the trajectory's pictures that the agent was shown for it.
        total: the reward so far.
        done: the numbers of the key actions that were done in it.
    """

    number: int
    turn: Turn
    tags: Sequence[str]
    pictures: Sequence[int]
    total: float
    done: Sequence[int]


def turns_of(trajectory: Trajectory) -> tuple[list[TurnView], list[PictureRecord]]:
    """The turns, and all pictures in order."""
    pictures: list[PictureRecord] = []
    views, total = [], 0.0
    left = list(range(len(trajectory.key_actions)))
    for number, turn in enumerate(trajectory.turns):
        shown = range(len(pictures), len(pictures) + len(turn.pictures))
        pictures += turn.pictures
        total += turn.reward
        done = [place for place in left[:1] if turn.earned]
        left = left[len(done) :]
        tags = [TAG_OF_KIND[thought.kind].lower() for thought in turn.thoughts]
        views.append(TurnView(number, turn, tags, list(shown), total, done))
    return views, pictures


def record_of(trajectory: Trajectory) -> EpisodeRecord:
    """The episode that became a trajectory, as far as playing it again needs it."""
    steps = [
        StepRecord(
            verb=turn.verb,
            object_type=turn.object_type,
            object_id=turn.object_id,
            success=turn.success,
            reward=turn.reward,
        )
        for turn in trajectory.turns
    ]
    return EpisodeRecord(
        task_id=trajectory.task_id,
        task_type=trajectory.task_type,
        scene=trajectory.scene,
        instruction=trajectory.instruction,
        name=trajectory.name,
        key_actions=trajectory.key_actions,
        max_steps=trajectory.max_steps,
        agent=trajectory.actor,
        seed=trajectory.seed,
        steps=[StepRecord(verb=INIT, success=True), *steps],
        success=trajectory.success,
        search_targets=trajectory.search_targets,
        end_reason=trajectory.end_reason,
        total_reward=sum(step.reward for step in steps),
        seconds=0.0,
    )
