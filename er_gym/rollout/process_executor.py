"""The executor for agents that use the CPU: whole episodes in worker processes.

Workers append events to the run's stream where they can, and write the files that agents leave.
Workers on other machines send both along with the episode. The caller's process alone writes
episodes.
"""

from __future__ import annotations

import pickle
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from pathlib import Path

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import CannotGoOn, MakeAgent
from er_gym.rollout.events import Event, EventLog
from er_gym.rollout.executor import (
    Assignment,
    EpisodeSettings,
    PlayedEpisode,
)
from er_gym.rollout.play import error_with_location, play_episode
from er_gym.rollout.processes import Terminated
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.task import Task


def play_in_processes(assigned: Assignment) -> None:
    """Play each task in one of ``parallelism.workers`` processes. See :class:`.Executor`."""
    make_agent, directory = assigned.make_agent, assigned.directory
    settings, parallelism = assigned.episodes, assigned.parallelism
    worker_backend = parallelism.worker_backend
    _check_picklable(make_agent)
    worker = partial(
        EpisodeWorker,
        make_agent,
        settings,
        directory.path.absolute(),
        appends_events=worker_backend.is_local,
        writes_files=worker_backend.shares_files and not worker_backend.is_local,
    )
    results = worker_backend.run_jobs(
        worker, assigned.tasks, workers=parallelism.workers, affinity_key=attrgetter("scene")
    )
    with closing(results), closing(EventLog(directory.path)) as events:
        for task, result in results:
            if isinstance(result, _Stop):
                raise CannotGoOn(result.message)
            if isinstance(result, LostJob):
                result = _Result(PlayedEpisode(settings.lost(task, result)))
            events.append(result.events)
            assigned.sink.save(result.played)
            assigned.sink.ended(result.played)


def _check_picklable(make_agent: MakeAgent) -> None:
    """Raise ValueError if ``make_agent`` cannot be sent to worker processes."""
    try:
        pickle.dumps(make_agent)
    except Exception as error:  # pickle raises PicklingError, AttributeError, TypeError and others
        raise ValueError(
            f"make_agent cannot be sent to worker processes ({type(error).__name__}: {error}); "
            "give a function or a frozen dataclass at the top of a module, or executor='threads'"
        ) from error


@dataclass(frozen=True)
class _Stop:
    """A worker returns it in place of an episode whose agent raised CannotGoOn."""

    message: str


@dataclass(frozen=True)
class _Result:
    """What a worker returns for a task.

    Attributes:
        played: the episode.
        events: its events that are not in the run's stream yet.
    """

    played: PlayedEpisode
    events: tuple[Event, ...] = ()


class EpisodeWorker:
    """Plays one episode after another in one environment, which it makes anew after a crash.

    It makes a new agent for each episode from the episode's seed. An episode's outcome thus does
    not depend on what this worker played before.

    Args:
        make_agent: makes the agent of an episode.
        settings: what the episodes have in common.
        directory: the run directory.
        appends_events: whether to append events to the stream in the run directory; else they are
            returned with the episode.
        writes_files: whether to write the agent's files into the run directory; else they are
            returned with the episode.
    """

    def __init__(
        self,
        make_agent: MakeAgent,
        settings: EpisodeSettings,
        directory: Path,
        *,
        appends_events: bool = True,
        writes_files: bool = False,
    ) -> None:
        self._make_agent = make_agent
        self._settings, self._manifest = settings, settings.manifest
        self._log = EventLog(directory) if appends_events else None
        self._unsent: list[Event] = []
        self._directory = RunDirectory(directory, self._manifest) if writes_files else None
        self._env: EmbodiedEnv | None = self._make_env()

    def _make_env(self) -> EmbodiedEnv:
        return EmbodiedEnv((), **self._manifest.env)

    def __call__(self, task: Task) -> _Result | _Stop:
        self._unsent.clear()
        played = self._play(task)
        if isinstance(played, _Stop):
            return played
        if self._directory is not None:
            self._directory.attach(task.id, played.attachments, played.folders)
            played = PlayedEpisode(played.record)
        return _Result(played, tuple(self._unsent))

    def _play(self, task: Task) -> PlayedEpisode | _Stop:
        seed = self._settings.seed(task)
        try:
            if self._env is None:
                self._env = self._make_env()
            agent = self._make_agent(task, seed)
        except CannotGoOn as stop:
            return _Stop(str(stop))
        except Terminated:
            raise
        except (Exception, SystemExit) as error:  # it must not end the run, as in play_episode
            return PlayedEpisode(self._settings.unbegun(task, error_with_location(error)))
        try:
            record = play_episode(
                self._env,
                agent,
                task,
                seed,
                agent_name=self._manifest.agent,
                max_steps=self._manifest.env.get("max_steps"),
                emit=self._log or self._unsent.append,
            )
        except CannotGoOn as stop:
            return _Stop(str(stop))
        if record.error:
            self._close_env()
        return PlayedEpisode.by(agent, record)

    def _close_env(self) -> None:
        """Close the environment; the next episode makes another."""
        env, self._env = self._env, None
        if env is not None:
            env.close()

    def close(self) -> None:
        """Close the environment and the event stream."""
        self._close_env()
        if self._log is not None:
            self._log.close()
