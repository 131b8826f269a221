"""The executor for agents that wait for a model: a thread for each episode, engines elsewhere.

It suits agents that use a server, or a model in this process. The engines run in worker processes.
While one agent waits for its reply, the engines of the others work.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

from er_gym.rollout.agent import Agent, CannotGoOn, Decision, MakeAgent
from er_gym.rollout.env_pool import EnvLost, EnvPool, RemoteEnv
from er_gym.rollout.events import EventListener, EventLog, ignore_event
from er_gym.rollout.executor import Assignment, EpisodeSettings, EpisodeSink, PlayedEpisode
from er_gym.rollout.play import Playable, error_with_location, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.task import Task

_TRIES = 3
"""The number of tries at an episode whose process dies."""


def play_in_threads(assigned: Assignment) -> None:
    """Play ``parallelism.concurrency`` tasks at once; see :class:`.executor.Executor`.

    Each agent is made, and acts, in the thread of its episode. If an agent cannot go on, the run
    waits for the replies under way. Episodes that these replies do not finish leave no record. At
    Ctrl-C the run waits for nothing.
    """
    directory, parallelism = assigned.directory, assigned.parallelism
    slots = min(parallelism.concurrency, len(assigned.tasks))
    with (
        EnvPool(
            parallelism.workers,
            slots,
            directory.manifest.env,
            deadline=parallelism.deadline,
            worker_backend=parallelism.worker_backend,
        ) as pool,
        closing(EventLog(directory.path)) as events,
    ):
        play_in_pool(
            pool, assigned.episodes, assigned.tasks, assigned.make_agent, assigned.sink, events
        )


def play_in_pool(
    pool: EnvPool,
    episodes: EpisodeSettings,
    tasks: Sequence[Task],
    make_agent: MakeAgent,
    sink: EpisodeSink,
    events: EventListener = ignore_event,
    dress: Callable[[RemoteEnv, Task], Playable] = lambda env, task: env,
) -> None:
    """Play tasks in a pool that stays open, as many at once as it has slots.

    Args:
        pool: the environments.
        episodes: what the episodes have in common.
        tasks: one episode is played of each; no two have the same id.
        make_agent, sink: see :class:`.executor.Assignment`.
        events: called with the steps and replies, in many threads.
        dress: puts something around a slot's environment for the episode of a task.
    """
    todo = deque(tasks)
    talking = min(pool.slots, len(todo))
    stopped: CannotGoOn | None = None
    threads = _ThreadedRun(episodes, pool, make_agent, events, dress, todo)
    try:
        for slot in range(talking):
            # Daemon threads: one that waits for a reply must not keep the process from ending.
            threading.Thread(target=threads.play_all, args=(slot,), daemon=True).start()
        while talking:
            threads.unhandled.acquire()
            result = threads.results[0]
            if isinstance(result, PlayedEpisode):
                sink.save(result)
                sink.ended(result)
            elif result is None:
                talking -= 1
            elif isinstance(result, CannotGoOn):
                stopped = stopped or result
            else:
                raise result
            threads.results.popleft()
    finally:
        threads.stopping.set()
        # Save what is over, also the episode whose saving Ctrl-C interrupted.
        for result in tuple(threads.results):
            if isinstance(result, PlayedEpisode):
                sink.save(result)
    if stopped is not None:
        raise stopped


class _Stopping(CannotGoOn):
    """Ends an episode because the run stops; the episode has no record."""


@dataclass(frozen=True)
class _ThreadedRun:
    """What the threads of a run share.

    Attributes:
        results: the queue from the threads to the main thread: an episode, an exception that ends
            the run, or None from a thread that has ended. The main thread removes a result once it
            has handled it.
        unhandled: counts the results that the main thread has not handled yet.
        stopping: set when no agent may act any more.
    """

    settings: EpisodeSettings
    pool: EnvPool
    make_agent: MakeAgent
    events: EventListener
    dress: Callable[[RemoteEnv, Task], Playable]
    todo: deque[Task]
    results: deque[PlayedEpisode | BaseException | None] = field(default_factory=deque)
    unhandled: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    stopping: threading.Event = field(default_factory=threading.Event)

    def play_all(self, slot: int) -> None:
        """Run a thread: play one episode after another in the environment of a slot."""
        try:
            while not self.stopping.is_set():
                try:
                    task = self.todo.popleft()
                except IndexError:
                    break
                self._put(self._episode(slot, task))
        except _Stopping:
            pass
        except BaseException as error:  # the main thread raises it
            self._put(error)
            self.stopping.set()
        finally:
            self._put(None)

    def _put(self, result: PlayedEpisode | BaseException | None) -> None:
        self.results.append(result)
        self.unhandled.release()

    def _episode(self, slot: int, task: Task) -> PlayedEpisode:
        """Play a task, again with a new agent if its process dies."""
        seed = self.settings.seed(task)
        tries = 0
        while True:
            agent: Agent | None = None
            lost: EnvLost | None
            try:
                env = self.pool.env(slot)
            except EnvLost as error:
                lost = error
            else:
                agent, record = self._play(env, task, seed)
                lost = env.lost
                if record.error and lost is None:
                    env.close()
            if self.pool.closed:
                raise _Stopping
            if lost is not None:
                tries += lost.at_fault
                if tries < _TRIES:
                    if self.stopping.is_set():
                        raise _Stopping
                    continue
                record = self.settings.lost(task, LostJob(tries, lost.exitcode, lost.why))
            return PlayedEpisode.by(agent, record)

    def _play(self, env: RemoteEnv, task: Task, seed: int) -> tuple[Agent | None, EpisodeRecord]:
        manifest = self.settings.manifest
        try:
            agent = self.make_agent(task, seed)
            player = _Stoppable(agent, self.stopping)
        except CannotGoOn:
            raise
        except (Exception, SystemExit) as error:  # it must not end the run, as in play_episode
            return None, self.settings.unbegun(task, error_with_location(error))
        record = play_episode(
            self.dress(env, task),
            player,
            task,
            seed,
            agent_name=manifest.agent,
            max_steps=manifest.env.get("max_steps"),
            emit=self.events,
        )
        return agent, record


class _Stoppable:
    """An agent that stops acting when the run stops."""

    def __init__(self, agent: Agent, stopping: threading.Event) -> None:
        self.obs_mode = agent.obs_mode
        self._agent, self._stopping = agent, stopping

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        self._agent.reset(task, obs, info)

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        if self._stopping.is_set():
            raise _Stopping
        return self._agent.act(obs, info)
