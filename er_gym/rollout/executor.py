"""What all executors share: the played episode, the sink for it, and how much runs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from er_gym.rollout.agent import (
    Agent,
    Attachments,
    CannotGoOn,
    LeavesAttachments,
    MakeAgent,
    check_attachments,
)
from er_gym.rollout.play import episode_seed, error_with_location
from er_gym.rollout.records import EpisodeRecord, record_episode
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.worker_backend import LOCAL_BACKEND, WorkerBackend
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.task import Task
from er_gym.writing import file_stem


@dataclass(frozen=True)
class PlayedEpisode:
    """An episode that is over or has crashed.

    Attributes:
        record: the episode's record.
        attachments: the files that the agent leaves, bytes by path in the run directory.
        folders: the folders of the run directory that the files go to.
    """

    record: EpisodeRecord
    attachments: Attachments = field(default_factory=dict)
    folders: Sequence[str] = ()

    @classmethod
    def by(cls, agent: Agent | None, record: EpisodeRecord) -> PlayedEpisode:
        """The episode with the files that its agent leaves.

        If the agent fails to hand over its files, or names a path outside its folders, the episode
        counts as crashed: its record says so, and the next run plays it again.

        Args:
            agent: None if it could not be made.
            record: the episode's record.
        """
        if agent is None or not isinstance(agent, LeavesAttachments):
            return cls(record)
        stem = file_stem(record.task_id)
        try:
            folders = tuple(agent.attachment_folders)
            files = dict(agent.attachments(record, stem))
            check_attachments(files, folders, stem)
        except CannotGoOn:
            raise
        except Exception as error:  # agents are other people's code and must not end the run
            problem = record.error or error_with_location(error)
            crashed = {"success": False, "end_reason": "", "error": problem}
            return cls(record.model_copy(update=crashed))
        return cls(record, files, folders)


class EpisodeSink(Protocol):
    """Takes episodes. The executor calls it in the thread that called the executor."""

    def save(self, played: PlayedEpisode) -> None:
        """Write an episode into the run directory. Saving it twice does no harm."""

    def ended(self, played: PlayedEpisode) -> None:
        """Count an episode that has been saved, and call the listeners."""


@dataclass(frozen=True)
class Parallelism:
    """How much runs at once.

    Attributes:
        workers: the number of worker processes, at least 1.
        concurrency: the number of episodes at once, at least 1, for executors that play several
            episodes in one process.
        deadline: seconds within which an environment in another process must answer. The time
            includes the wait for the other environments of that process. When it is over, the
            process is killed.
        worker_backend: where the worker processes run.

    Raises:
        ValueError: a number is out of its range.
    """

    workers: int = 1
    concurrency: int = 8
    deadline: float = 600.0
    worker_backend: WorkerBackend = LOCAL_BACKEND

    def __post_init__(self) -> None:
        for name, value in (("workers", self.workers), ("concurrency", self.concurrency)):
            if value < 1:
                raise ValueError(f"{name} is {value}; give a whole number from 1")
        if not self.deadline > 0:
            raise ValueError(f"deadline is {self.deadline}; give seconds above 0")


@dataclass(frozen=True)
class Assignment:
    """What an executor is to play.

    Attributes:
        directory: the run directory.
        tasks: one episode is played of each. A task that is played several times is here as often,
            each time under the key of its episode (:func:`.records.episode_key`) as its id.
        make_agent: makes the agent of an episode.
        sink: takes the episodes.
        parallelism: how much runs at once.
        seeds: the seeds of episodes by key, where they do not follow from the run's.
    """

    directory: RunDirectory
    tasks: Sequence[Task]
    make_agent: MakeAgent
    sink: EpisodeSink
    parallelism: Parallelism
    seeds: Mapping[str, int] = field(default_factory=dict)

    @property
    def episodes(self) -> EpisodeSettings:
        """What the episodes have in common."""
        return EpisodeSettings(self.directory.manifest, self.seeds)


@dataclass(frozen=True)
class EpisodeSettings:
    """What the episodes of a run have in common; it is sent to worker processes.

    Attributes:
        manifest: the run's.
        seeds: see :class:`Assignment`.
    """

    manifest: Manifest
    seeds: Mapping[str, int]

    def seed(self, task: Task) -> int:
        """The seed of an episode."""
        own = self.seeds.get(task.id)
        return episode_seed(self.manifest.seed, task.id) if own is None else own

    def unbegun(self, task: Task, error: str) -> EpisodeRecord:
        """The record of an episode that crashed before the step limit was known."""
        return record_episode(
            task,
            agent=self.manifest.agent,
            seed=self.seed(task),
            max_steps=self.manifest.env.get("max_steps"),
            error=error,
        )

    def lost(self, task: Task, lost: LostJob) -> EpisodeRecord:
        """The record of an episode whose worker died every time."""
        return self.unbegun(task, str(lost))


class Executor(Protocol):
    """Plays tasks; a row of :data:`er_gym.rollout.runner.EXECUTORS`."""

    def __call__(self, assigned: Assignment) -> None:
        """Play every task, and hand each episode to the sink before looking at the next.

        Raises:
            CannotGoOn: an agent said that no further episode can be played.
            WorkerSetupError: the environment cannot be made.
            ValueError: the executor cannot use ``make_agent``.
            KeyboardInterrupt: Ctrl-C. The episodes handed over so far are saved, and no process is
                left.
        """
