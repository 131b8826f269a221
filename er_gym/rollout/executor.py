"""What every way of executing a run shares: a played episode, and who takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from er_gym.rollout.agent import Agent, Attachments, LeavesAttachments, MakeAgent
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import EpisodeRecord, record_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.task import Task
from er_gym.writing import file_stem


@dataclass(frozen=True)
class PlayedEpisode:
    """An episode that is over or has crashed.

    Attributes:
        record: of it.
        attachments: the files that its agent leaves.
        folders: the folders of the run directory that these go to.
    """

    record: EpisodeRecord
    attachments: Attachments = field(default_factory=dict)
    folders: Sequence[str] = ()

    @classmethod
    def by(cls, agent: Agent | None, record: EpisodeRecord) -> PlayedEpisode:
        """An episode with the files that its agent leaves; None if it could not be made."""
        if not isinstance(agent, LeavesAttachments):
            return cls(record)
        files = agent.attachments(record, file_stem(record.task_id))
        return cls(record, files, agent.attachment_folders)


class EpisodeSink(Protocol):
    """Takes episodes, in the thread that called the executor."""

    def save(self, played: PlayedEpisode) -> None:
        """Put an episode into the run directory; doing it twice does no harm."""

    def ended(self, played: PlayedEpisode) -> None:
        """Count an episode that has been saved, and tell whoever listens."""


@dataclass(frozen=True)
class Parallelism:
    """How much is done at once.

    Attributes:
        workers: how many processes.
        concurrency: how many episodes at once, for executors that play several in a process.
        deadline: seconds that a step of an environment in another process may take, with the wait
            for others in that process; the process is killed then.
    """

    workers: int = 1
    concurrency: int = 8
    deadline: float = 600.0


class Executor(Protocol):
    """Plays tasks; a row of :data:`er_gym.rollout.runner.EXECUTORS`."""

    def __call__(
        self,
        directory: RunDirectory,
        tasks: Sequence[Task],
        make_agent: MakeAgent,
        sink: EpisodeSink,
        parallelism: Parallelism,
    ) -> None:
        """Play every task and hand each episode to ``sink``, saved before the next is looked at.

        Raises:
            CannotGoOn: an agent said that no further episode can be played.
            WorkerSetupError: the environment cannot be made.
            KeyboardInterrupt: Ctrl-C; what is over has been saved, and no process is left.
        """


def lost_episode(task: Task, lost: LostJob, directory: RunDirectory) -> EpisodeRecord:
    """The record of an episode whose worker died every time."""
    return record_episode(
        task,
        agent=directory.manifest.agent,
        seed=episode_seed(directory.manifest.seed, task.id),
        max_steps=directory.manifest.env.get("max_steps"),
        error=f"the worker process died {lost.tries} times, last with exit code {lost.exitcode}",
    )
