"""Play many episodes at once whose agents mostly wait: a thread each, engines in other processes.

For agents that ask a server, or a model that this process holds: while one waits for its reply, the
others' engines work.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from er_gym.rollout.agent import Agent, CannotGoOn, Decision, MakeAgent
from er_gym.rollout.env_pool import EnvLost, EnvPool, RemoteEnv
from er_gym.rollout.events import EventLog
from er_gym.rollout.executor import Played, Sink, Size, lost_episode
from er_gym.rollout.play import episode_seed, one_line, play_episode
from er_gym.rollout.records import EpisodeRecord, record_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.worker_pool import Lost
from er_gym.tasks.task import Task

_TRIES = 3
"""How often an episode is tried whose process dies."""


def play_in_threads(
    directory: RunDirectory,
    tasks: Sequence[Task],
    make_agent: MakeAgent,
    sink: Sink,
    size: Size,
) -> None:
    """Play ``size.concurrency`` tasks at once; see :class:`.executor.Executor`.

    Agents are made, and asked, in the thread of their episode. When one cannot go on, the others'
    next replies are waited for; episodes that are not over with these leave no record. At Ctrl-C
    nothing is waited for.
    """
    todo = deque(tasks)
    slots = talking = min(size.concurrency, len(todo))
    stopped: CannotGoOn | None = None
    env = directory.manifest.env
    with EnvPool(size.workers, slots, env, deadline=size.deadline) as pool:
        events = EventLog(directory.path)
        threads = _Threads(directory, pool, make_agent, events, todo)
        try:
            for slot in range(slots):
                # Daemons: one that waits for a reply must not keep the process from ending.
                threading.Thread(target=threads.play_all, args=(slot,), daemon=True).start()
            while talking:
                threads.told.acquire()
                result = threads.results[0]
                if isinstance(result, Played):
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
            # What is over is saved, also the episode whose saving Ctrl-C interrupted.
            for result in tuple(threads.results):
                if isinstance(result, Played):
                    sink.save(result)
            events.close()
    if stopped is not None:
        raise stopped


class _Stopping(CannotGoOn):
    """The run stops; not to be recorded, nor told."""


@dataclass(frozen=True)
class _Threads:
    """What the threads of a run share.

    Attributes:
        results: what they tell: an episode; what ends the run; None from a thread that has ended.
            The main thread removes what it has dealt with.
        told: counts the results that the main thread has not looked at.
        stopping: set when no agent is to act any more.
    """

    directory: RunDirectory
    pool: EnvPool
    make_agent: MakeAgent
    events: EventLog
    todo: deque[Task]
    results: deque[Played | BaseException | None] = field(default_factory=deque)
    told: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    stopping: threading.Event = field(default_factory=threading.Event)

    def play_all(self, slot: int) -> None:
        """A thread: one episode after the other in the environment of a slot."""
        try:
            while not self.stopping.is_set():
                try:
                    task = self.todo.popleft()
                except IndexError:
                    break
                self._tell(self._episode(slot, task))
        except _Stopping:
            pass
        except BaseException as error:  # whatever it is, the main thread must hear of it
            self._tell(error)
            self.stopping.set()
        finally:
            self._tell(None)

    def _tell(self, result: Played | BaseException | None) -> None:
        self.results.append(result)
        self.told.release()

    def _episode(self, slot: int, task: Task) -> Played:
        """Play a task, again with a new agent if its process dies."""
        seed = episode_seed(self.directory.manifest.seed, task.id)
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
                record = lost_episode(task, Lost(tries, lost.exitcode), self.directory)
            return Played.by(agent, record)

    def _play(self, env: RemoteEnv, task: Task, seed: int) -> tuple[Agent | None, EpisodeRecord]:
        manifest = self.directory.manifest
        try:
            agent = self.make_agent(task, seed)
            player = _Stoppable(agent, self.stopping)
        except CannotGoOn:
            raise
        except (Exception, SystemExit) as error:  # as in play_episode, one must not end the run
            return None, record_episode(
                task,
                agent=manifest.agent,
                seed=seed,
                max_steps=manifest.env.get("max_steps"),
                error=one_line(error),
            )
        record = play_episode(
            env,
            player,
            task,
            seed,
            agent_name=manifest.agent,
            max_steps=manifest.env.get("max_steps"),
            emit=self.events,
        )
        return agent, record


class _Stoppable:
    """An agent that does not act any more once the run stops."""

    def __init__(self, agent: Agent, stopping: threading.Event) -> None:
        self.obs_mode = agent.obs_mode
        self._agent, self._stopping = agent, stopping

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        self._agent.reset(task, obs, info)

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        if self._stopping.is_set():
            raise _Stopping
        return self._agent.act(obs, info)
