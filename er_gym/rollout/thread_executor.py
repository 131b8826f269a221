"""Play many episodes at once whose agents mostly wait: a thread each, engines in other processes.

:func:`run_threaded` does what :func:`er_gym.rollout.runner.run` does, for agents that ask a server or a
model that this process holds: while one waits for its reply, the others' engines work.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from er_gym.rollout.agent import Agent, CannotGoOn, Decision
from er_gym.rollout.env_pool import DEADLINE, EnvLost, EnvPool, RemoteEnv
from er_gym.rollout.play import episode_seed, one_line, play_episode
from er_gym.rollout.records import EpisodeRecord, record_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import Outcome, finished, lost_episode
from er_gym.rollout.worker_pool import Lost
from er_gym.tasks.task import Task

MakeAgent: TypeAlias = Callable[[Task, int], Agent]
Keep: TypeAlias = Callable[[EpisodeRecord, Agent], None]
_TRIES = 3


class Stopped(CannotGoOn):
    """An agent could not go on, so the run has stopped; ``outcome`` says what it did till then."""

    def __init__(self, message: str, outcome: Outcome) -> None:
        super().__init__(message)
        self.outcome = outcome


def run_threaded(
    store: RunDirectory,
    tasks: Sequence[Task],
    make_agent: MakeAgent,
    *,
    workers: int = 1,
    concurrency: int = 8,
    on_episode: Callable[[EpisodeRecord], None] = lambda episode: None,
    keep: Keep = lambda episode, agent: None,
    deadline: float = DEADLINE,
) -> Outcome:
    """Play the tasks that the store has no finished episode of, several at once.

    Each episode is in the store before the next result is looked at, so that a run that is
    interrupted or killed loses no more than the episodes being played. An episode whose engine died
    is played again with a new agent; one whose engine died three times is recorded as lost.

    Args:
        store: where to, and, in its manifest, with which environment and seed; the manifest's agent
            is how records name the agent.
        tasks: what to play.
        make_agent: makes the agent of an episode, given its task and seed; called in the episode's
            thread, as are the agent's methods.
        workers: how many processes hold the environments.
        concurrency: how many episodes are played at once.
        on_episode: called in this thread with each episode once it is kept.
        keep: called in the episode's thread with its record and its agent, once it is over or has
            crashed and before it is in the store; not where it is given up or tried again.
        deadline: seconds that a step of an environment may take, with the wait for others in its
            process; the process is killed then.

    Raises:
        Stopped: an agent raised :class:`~er_gym.rollout.agent.CannotGoOn`. The others' next replies have
            been waited for; of episodes that were not over with these there is no record.
        WorkerSetupError: the environment cannot be made.
        KeyboardInterrupt: Ctrl-C; nothing has been waited for, and workers have been stopped.
        Exception: what ``keep`` or ``on_episode`` raised; as at Ctrl-C.
    """
    done = {episode.task_id for episode in finished(store, tasks)}
    todo = deque(task for task in tasks if task.id not in done)
    if not todo:
        return Outcome(0, len(done), ())
    slots = talking = min(concurrency, len(todo))
    played, crashed = 0, []
    stopped: CannotGoOn | None = None
    with EnvPool(workers, slots, store.manifest.env, deadline=deadline) as engines:
        run = _Run(store, engines, make_agent, keep, todo)
        try:
            for slot in range(slots):
                # Daemons: one that waits for a reply must not keep the process from ending.
                threading.Thread(target=run.converse, args=(slot,), daemon=True).start()
            while talking:
                run.told.acquire()
                result = run.results[0]
                if isinstance(result, EpisodeRecord):
                    store.write(result)
                    played += 1
                    if result.error:
                        crashed.append(result)
                    on_episode(result)
                elif result is None:
                    talking -= 1
                elif isinstance(result, CannotGoOn):
                    stopped = stopped or result
                else:
                    raise result
                run.results.popleft()
        finally:
            run.stopping.set()
            # What is over is kept, also the one whose writing Ctrl-C came into.
            for result in tuple(run.results):
                if isinstance(result, EpisodeRecord):
                    store.write(result)
    outcome = Outcome(played, len(done), tuple(crashed))
    if stopped is not None:
        raise Stopped(str(stopped), outcome) from stopped
    return outcome


class _Stopping(CannotGoOn):
    """The run stops; not to be recorded, nor told."""


@dataclass(frozen=True)
class _Run:
    """What the threads of a run share.

    Attributes:
        results: what they tell: an episode; what ends the run; None from a thread that has ended.
            The main thread takes away what it has done with.
        told: counts the results that the main thread has not looked at.
        stopping: set when no agent is to act any more.
    """

    store: RunDirectory
    engines: EnvPool
    make_agent: MakeAgent
    keep: Keep
    todo: deque[Task]
    results: deque[EpisodeRecord | BaseException | None] = field(default_factory=deque)
    told: threading.Semaphore = field(default_factory=lambda: threading.Semaphore(0))
    stopping: threading.Event = field(default_factory=threading.Event)

    def converse(self, slot: int) -> None:
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

    def _tell(self, result: EpisodeRecord | BaseException | None) -> None:
        self.results.append(result)
        self.told.release()

    def _episode(self, slot: int, task: Task) -> EpisodeRecord:
        seed = episode_seed(self.store.manifest.seed, task.id)
        tries = 0
        while True:
            agent: Agent | None = None
            lost: EnvLost | None
            try:
                env = self.engines.env(slot)
            except EnvLost as error:
                lost = error
            else:
                agent, record = self._play(env, task, seed)
                lost = env.lost
                if record.error and lost is None:
                    env.close()
            if self.engines.closed:
                raise _Stopping
            if lost is not None:
                tries += lost.at_fault
                if tries < _TRIES:
                    if self.stopping.is_set():
                        raise _Stopping
                    continue
                record = lost_episode(task, Lost(tries, lost.exitcode), self.store)
            if agent is not None:
                self.keep(record, agent)
            return record

    def _play(self, env: RemoteEnv, task: Task, seed: int) -> tuple[Agent | None, EpisodeRecord]:
        manifest = self.store.manifest
        try:
            agent = self.make_agent(task, seed)
            player = _Stoppable(agent, self.stopping)
        except CannotGoOn:
            raise
        except Exception as error:  # as in play_episode, one must not end the run
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
