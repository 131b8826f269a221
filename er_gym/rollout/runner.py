"""Play (agent x tasks) in worker processes into a run directory; running again continues."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import Any

from agents import make_agent
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import episode_seed, one_line, play_episode
from er_gym.rollout.records import EpisodeRecord, record_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.worker_pool import Lost, do_jobs
from er_gym.tasks.errors import SetAside, in_short
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class Shard:
    """One of ``count`` parts of a suite, ``index`` counting from 1."""

    index: int
    count: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Read ``"2/8"``.

        Raises:
            ValueError: it is not of that form, or there is no such part.
        """
        index, slash, count = text.partition("/")
        if slash and index.isdecimal() and count.isdecimal() and 1 <= int(index) <= int(count):
            return cls(int(index), int(count))
        raise ValueError(f"{text!r} is no shard: give i/n with 1 <= i <= n, such as 2/8")

    def __contains__(self, task_id: str) -> bool:
        """Whether a task belongs to it: by a hash of its id, the same everywhere and for good."""
        digest = hashlib.sha256(task_id.encode()).digest()
        return int.from_bytes(digest[:8], "big") % self.count == self.index - 1


def select(
    tasks: Sequence[Task],
    *,
    task_ids: Iterable[str] = (),
    shard: Shard | None = None,
    limit: int | None = None,
    set_aside: Iterable[SetAside] = (),
) -> list[Task]:
    """The tasks to play, in the suite's order: those named, of these the shard's, of these the
    first ``limit``. Of tasks that were set aside none is played, named or not.

    Raises:
        ValueError: the suite has no task of a given id, or all that were named are set aside.
    """
    wanted = set(task_ids)
    aside = [one for one in set_aside if one.task in wanted]
    unknown = wanted.difference((task.id for task in tasks), (one.task for one in aside))
    if aside and len(aside) == len(wanted):
        raise ValueError(f"no task to play: {in_short(aside)}")
    if unknown:
        some = ", ".join(task.id for task in tasks[:3])
        raise ValueError(f"no task with the id {min(unknown)!r}; ids here are such as {some}")
    chosen = [
        task
        for task in tasks
        if (not wanted or task.id in wanted) and (shard is None or task.id in shard)
    ]
    return chosen[:limit]


class Player:
    """Plays one episode after another in one environment, made anew only after a crash.

    The agent is made for each episode, from the episode's seed, so that an episode's outcome does
    not depend on what this worker played before.
    """

    def __init__(self, agent: str, env: Mapping[str, Any], seed: int, trust: bool = False) -> None:
        self._agent, self._trust = agent, trust
        self._kwargs = dict(env)
        self._seed = seed
        self._env: EmbodiedEnv | None = self._make_env()

    def _make_env(self) -> EmbodiedEnv:
        return EmbodiedEnv((), **self._kwargs)

    def __call__(self, task: Task) -> EpisodeRecord:
        seed = episode_seed(self._seed, task.id)
        try:
            if self._env is None:
                self._env = self._make_env()
            agent = make_agent(self._agent, seed=seed, trust=self._trust)
        except Exception as error:  # as in play_episode, one must not end the run
            return record_episode(
                task,
                agent=self._agent,
                seed=seed,
                max_steps=self._kwargs.get("max_steps"),
                error=one_line(error),
            )
        record = play_episode(
            self._env,
            agent,
            task,
            seed,
            agent_name=self._agent,
            max_steps=self._kwargs.get("max_steps"),
        )
        if record.error:
            self.close()
        return record

    def close(self) -> None:
        """Close the environment; the next episode makes another."""
        env, self._env = self._env, None
        if env is not None:
            env.close()


@dataclass(frozen=True)
class Outcome:
    """What :func:`run` did.

    Attributes:
        played: how many episodes it played.
        kept: how many it found done.
        crashed: of those played, the episodes that crashed or whose worker died again and again.
            They are in the store, count as failures, and are played again by the next run.
    """

    played: int
    kept: int
    crashed: tuple[EpisodeRecord, ...]


def finished(store: RunDirectory, tasks: Iterable[Task]) -> list[EpisodeRecord]:
    """The episodes of these tasks that need not be played again: those that did not crash."""
    ids = {task.id for task in tasks}
    return [each for each in store.episodes() if each.task_id in ids and not each.error]


def run(
    store: RunDirectory,
    tasks: Sequence[Task],
    *,
    workers: int = 1,
    on_episode: Callable[[EpisodeRecord], None] = lambda episode: None,
    trust: bool = False,
) -> Outcome:
    """Play the tasks that the store has no finished episode of.

    Each episode is in the store before the next result is looked at, so that a run that is
    interrupted or killed loses no more than the episodes being played.

    Args:
        store: where to, and, in its manifest, with which agent, environment and seed.
        tasks: what to play.
        workers: how many processes.
        on_episode: called in this process with each episode once it is kept.
        trust: see :func:`agents.make_agent`. It is no part of the manifest, which may be anybody's.

    Raises:
        WorkerSetupError: the environment cannot be made in a worker.
        KeyboardInterrupt: Ctrl-C; workers have been stopped.
    """
    manifest = store.manifest
    done = {episode.task_id for episode in finished(store, tasks)}
    todo = [task for task in tasks if task.id not in done]
    player = partial(Player, manifest.agent, manifest.env, manifest.seed, trust)
    crashed = []
    with closing(do_jobs(player, todo, workers=workers)) as results:
        for task, result in results:
            episode = lost_episode(task, result, store) if isinstance(result, Lost) else result
            store.write(episode)
            if episode.error:
                crashed.append(episode)
            on_episode(episode)
    return Outcome(len(todo), len(done), tuple(crashed))


def lost_episode(task: Task, lost: Lost, store: RunDirectory) -> EpisodeRecord:
    """The record of an episode whose worker died every time."""
    return record_episode(
        task,
        agent=store.manifest.agent,
        seed=episode_seed(store.manifest.seed, task.id),
        max_steps=store.manifest.env.get("max_steps"),
        error=f"the worker process died {lost.tries} times, last with exit code {lost.exitcode}",
    )
