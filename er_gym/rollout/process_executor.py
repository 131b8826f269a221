"""Play whole episodes in worker processes: for agents that compute."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import CannotGoOn, MakeAgent
from er_gym.rollout.events import EventLog
from er_gym.rollout.executor import Played, Sink, Size, lost_episode
from er_gym.rollout.play import episode_seed, one_line, play_episode
from er_gym.rollout.processes import Terminated
from er_gym.rollout.records import record_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.worker_pool import Lost, do_jobs
from er_gym.tasks.task import Task


def play_in_processes(
    directory: RunDirectory,
    tasks: Sequence[Task],
    make_agent: MakeAgent,
    sink: Sink,
    size: Size,
) -> None:
    """Play each task in one of ``size.workers`` processes; see :class:`.executor.Executor`."""
    manifest = directory.manifest
    worker = partial(
        EpisodeWorker, make_agent, manifest.agent, manifest.env, manifest.seed, directory.path
    )
    with closing(do_jobs(worker, tasks, workers=size.workers)) as results:
        for task, result in results:
            if isinstance(result, _Stop):
                raise CannotGoOn(result.message)
            lost = isinstance(result, Lost)
            played = Played(lost_episode(task, result, directory)) if lost else result
            sink.save(played)
            sink.ended(played)


@dataclass(frozen=True)
class _Stop:
    """In place of an episode: its agent cannot go on."""

    message: str


class EpisodeWorker:
    """Plays one episode after another in one environment, made anew only after a crash.

    The agent is made for each episode, from the episode's seed, so that an episode's outcome does
    not depend on what this worker played before.

    Args:
        make_agent: makes it.
        agent: how records name it.
        env: the keyword arguments of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
        seed: the run's.
        directory: the run's, whose event stream is written to.
    """

    def __init__(
        self,
        make_agent: MakeAgent,
        agent: str,
        env: Mapping[str, Any],
        seed: int,
        directory: Path,
    ) -> None:
        self._make_agent = make_agent
        self._name = agent
        self._kwargs = dict(env)
        self._seed = seed
        self._events = EventLog(directory)
        self._env: EmbodiedEnv | None = self._make_env()

    def _make_env(self) -> EmbodiedEnv:
        return EmbodiedEnv((), **self._kwargs)

    def __call__(self, task: Task) -> Played | _Stop:
        seed = episode_seed(self._seed, task.id)
        try:
            if self._env is None:
                self._env = self._make_env()
            agent = self._make_agent(task, seed)
        except CannotGoOn as stop:
            return _Stop(str(stop))
        except Terminated:
            raise
        except (Exception, SystemExit) as error:  # as in play_episode, one must not end the run
            return Played(
                record_episode(
                    task,
                    agent=self._name,
                    seed=seed,
                    max_steps=self._kwargs.get("max_steps"),
                    error=one_line(error),
                )
            )
        try:
            record = play_episode(
                self._env,
                agent,
                task,
                seed,
                agent_name=self._name,
                max_steps=self._kwargs.get("max_steps"),
                emit=self._events,
            )
        except CannotGoOn as stop:
            return _Stop(str(stop))
        if record.error:
            self._close_env()
        return Played.by(agent, record)

    def _close_env(self) -> None:
        """The next episode makes another."""
        env, self._env = self._env, None
        if env is not None:
            env.close()

    def close(self) -> None:
        """Close the environment and the event stream."""
        self._close_env()
        self._events.close()
