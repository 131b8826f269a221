"""Which trajectories are taken into a collection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from agents.expert.recipe import ANOMALY, CORRECTED, SEARCH
from er_gym.data.course_checks import SHORTEST, are_key_actions
from er_gym.data.trajectory import Trajectory
from er_gym.envs.actions import Action
from er_gym.rollout.records import EpisodeRecord, KeyActionRecord, StepRecord


def steps_of(episode: EpisodeRecord) -> list[StepRecord]:
    """The steps that the agent took."""
    return [step for step in episode.steps[1:] if not step.appended]


@dataclass(frozen=True)
class PlayedCourse:
    """The facts of an episode that decide whether its trajectory is taken.

    Attributes:
        kind, mode: of the trajectory.
        success: whether the task was done.
        key_actions: the task's.
        actions: what was done, ``end`` included.
        done: for each action, whether it was done.
    """

    kind: str
    mode: str
    success: bool
    key_actions: Sequence[KeyActionRecord]
    actions: Sequence[Action]
    done: Sequence[bool]

    @classmethod
    def of_trajectory(cls, trajectory: Trajectory) -> PlayedCourse:
        """The course of a trajectory."""
        return cls(
            trajectory.kind,
            trajectory.mode,
            trajectory.success,
            trajectory.key_actions,
            [turn.action for turn in trajectory.turns],
            [turn.success for turn in trajectory.turns],
        )

    @classmethod
    def of_episode(cls, episode: EpisodeRecord, kind: str, mode: str) -> PlayedCourse:
        """The course of an episode that an expert or an explorer played."""
        steps = steps_of(episode)
        return cls(
            kind,
            mode,
            episode.success,
            episode.key_actions,
            [Action(step.verb, step.object_type) for step in steps],
            [step.success for step in steps],
        )


def rejection(course: PlayedCourse, most_actions: int) -> str:
    """Why a trajectory with this course is not taken, ``""`` if it is.

    Args:
        course: what was done.
        most_actions: longer trajectories are not taken.
    """
    if not course.success:
        return "no success"
    if len(course.actions) > most_actions:
        return "too long"
    only_key_actions = are_key_actions(course.actions, course.key_actions)
    if course.kind == SHORTEST and not only_key_actions:
        return "more than the key actions"
    if (course.kind in ("a", "c") or course.mode == SEARCH) and only_key_actions:
        return "nothing was searched"
    repeated = any(one == other for one, other in pairwise(course.actions))
    if course.kind == ANOMALY and all(course.done) and not repeated:
        return "nothing went wrong"
    if course.kind not in (ANOMALY, CORRECTED) and not all(course.done):
        return "an action was refused"
    return ""
