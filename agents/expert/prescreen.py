"""Prescreening: candidates are played without pictures and thoughts, to see which will be taken.

Two thirds of the candidates are not taken: their object was in view from the beginning, nothing
went wrong, the explorer did not find it. A prescreening costs a tenth of an episode with pictures.
An episode comes out the same as its prescreening, since both have the same seed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any

from agents.expert.acceptance import PlayedCourse, rejection
from agents.expert.candidates import Candidate
from agents.expert.corrections import first_mistake
from agents.expert.course import Course, Intent, View
from agents.expert.recorder import joined_modes
from agents.expert.thought_kinds import ThoughtKinds
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.worker_backend import LOCAL_BACKEND, WorkerBackend
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.task import Task

ATTEMPT = "attempt"
"""What corrections name as the run of an episode that was only attempted."""
_MOST_AT_ONCE = 60
"""A job has at most this many candidates, so that a worker that dies loses little."""


@dataclass(frozen=True)
class PrescreenResult:
    """The result of a prescreening.

    Attributes:
        candidate: the candidate; a correction has the beginning that it corrects now.
        reason: why it would not be taken, ``""`` if it will be.
    """

    candidate: Candidate
    reason: str = ""


def prescreen(
    candidates: Sequence[Candidate],
    *,
    env: Mapping[str, Any],
    observes: str = "",
    seed: int,
    kinds: ThoughtKinds,
    most_actions: int,
    workers: int,
    worker_backend: WorkerBackend = LOCAL_BACKEND,
) -> Iterator[PrescreenResult]:
    """Play candidates without thoughts in worker processes; yields each result when it is known.

    Args:
        candidates: of one part.
        env: keyword arguments of the part's environment, without ``obs_mode``.
        observes: the observations that the candidates' courses need.
        seed: the run's, from which an episode's seed is derived.
        kinds: draws how tasks end.
        most_actions: longer trajectories are not taken.
        workers: the number of processes.
        worker_backend: where they run.

    Raises:
        WorkerSetupError: the environment cannot be made.
    """
    env = {**env, "obs_mode": joined_modes(SilentAgent.obs_mode, observes)}
    make = partial(_Prescreener, env, seed, kinds, most_actions)
    jobs = [*_jobs(candidates)]
    with closing(
        worker_backend.run_jobs(make, jobs, workers=workers, affinity_key=_room)
    ) as results:
        for job, result in results:
            if isinstance(result, LostJob):
                yield from (PrescreenResult(each, "its prescreening crashed") for each in job)
            else:
                yield from result


def _jobs(candidates: Iterable[Candidate]) -> Iterator[tuple[Candidate, ...]]:
    """Candidates of one room each, so that only one worker warms the room up."""
    ordered = sorted(candidates, key=lambda each: (each.task.scene, each.id))
    for _, group in groupby(ordered, key=lambda each: each.task.scene):
        together = tuple(group)
        for first in range(0, len(together), _MOST_AT_ONCE):
            yield together[first : first + _MOST_AT_ONCE]


def _room(job: Sequence[Candidate]) -> str:
    return job[0].task.scene


class SilentAgent:
    """Does what a course decides, without thoughts, where only the actions are needed."""

    obs_mode = "objects"

    def __init__(self, course: Course) -> None:
        self._course = course

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._intents: Iterator[Intent] | None = None

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The course's next action."""
        self._course.view = View.of(obs, info)
        if self._intents is None:
            self._intents = self._course.intents()
        return Decision(next(self._intents).action)


class _Prescreener:
    """Plays the candidates of a job in one environment."""

    def __init__(
        self, env: dict[str, Any], seed: int, kinds: ThoughtKinds, most_actions: int
    ) -> None:
        self._env = EmbodiedEnv((), **env)
        self._seed, self._kinds, self._most = seed, kinds, most_actions

    def __call__(self, job: Sequence[Candidate]) -> list[PrescreenResult]:
        return [self._result(each) for each in job]

    def _result(self, candidate: Candidate) -> PrescreenResult:
        if candidate.actor == "corrector" and candidate.beginning is None:
            beginning = first_mistake(self._play(candidate))
            if beginning.problem:
                return PrescreenResult(candidate, f"attempt: {beginning.problem}")
            candidate = replace(
                candidate, beginning=beginning, run=ATTEMPT, episode=candidate.id, strength=None
            )
        episode = self._play(candidate)
        course = PlayedCourse.of_episode(episode, candidate.kind, candidate.mode)
        return PrescreenResult(candidate, rejection(course, self._most))

    def _play(self, candidate: Candidate) -> EpisodeRecord:
        seed = episode_seed(self._seed, candidate.id)
        agent = SilentAgent(candidate.course(seed, self._kinds))
        return play_episode(self._env, agent, candidate.played_task, seed)

    def close(self) -> None:
        """Close the environment."""
        self._env.close()
