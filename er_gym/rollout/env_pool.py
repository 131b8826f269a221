"""A pool of environments in worker processes, for agents in threads of this process.

A process holds several environments. Unlike :mod:`er_gym.rollout.worker_pool`, which plays whole
episodes in other processes, the agent stays in this process, because it mostly waits for a server's
reply. Only the engine, which needs a core and memory, runs elsewhere.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Mapping
from typing import Any

from er_gym.envs.actions import Action
from er_gym.rollout.env_worker import EnvLost, EnvWorker, request_to, result_of
from er_gym.rollout.worker_backend import LOCAL_BACKEND, WorkerBackend
from er_gym.rollout.worker_pool import WorkerSetupError
from er_gym.tasks.task import Task

__all__ = ["DEADLINE_SECONDS", "EnvLost", "EnvPool", "RemoteEnv"]

DEADLINE_SECONDS = 600.0
"""Seconds after which an environment that has not answered counts as stuck."""


class EnvPool:
    """``slots`` environments in ``workers`` spawned processes; use it in a ``with`` statement.

    Slot ``i`` is in process ``i % workers``. A process that has died is started again when one of
    its slots is next used. Processes ignore Ctrl-C. They end when this process ends, in any way.

    Args:
        workers: the number of processes, at least 1; at most one for each slot is started.
        slots: the number of environments.
        env: the keyword arguments of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
        deadline: seconds; a process that leaves a request unanswered for longer is killed.
        worker_backend: where the processes run.

    Attributes:
        slots: as above.
        closed: whether the ``with`` statement has ended, so that the processes end or have ended.
    """

    def __init__(
        self,
        workers: int,
        slots: int,
        env: Mapping[str, Any],
        *,
        deadline: float = DEADLINE_SECONDS,
        worker_backend: WorkerBackend = LOCAL_BACKEND,
    ) -> None:
        self.deadline = deadline
        self.closed = False
        self._workers, self.slots = min(workers, slots), slots
        self._kwargs, self._worker_backend = dict(env), worker_backend
        self._lock = threading.Lock()  # guards starting and ending processes
        self._team: list[EnvWorker] = []

    def __enter__(self) -> EnvPool:
        try:
            for place in range(self._workers):
                self._team.append(self._start(place))
        except BaseException:  # Ctrl-C too
            self._close()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        self._close()

    def env(self, slot: int) -> RemoteEnv:
        """The environment of a slot, for one thread; it is made if the slot has none.

        Raises:
            WorkerSetupError: the environment cannot be made.
            EnvLost: the process died while making it, or the pool is closed.
        """
        place = slot % self._workers
        with self._lock:
            if self.closed:
                raise self._team[place].end()
            if not self._team[place].alive:
                self._team[place] = self._start(place)
            env = RemoteEnv(self, self._team[place], slot)
        try:
            env._ask("make")
        except EnvLost:
            raise
        except Exception as error:
            raise WorkerSetupError(f"{type(error).__name__}: {error}") from error
        return env

    def _start(self, place: int) -> EnvWorker:
        slots = range(place, self.slots, self._workers)
        return self._worker_backend.start_env_worker(slots, self._kwargs)

    def _close(self) -> None:
        with self._lock:
            self.closed = True
            for worker in self._team:
                worker.dismiss()
            for worker in self._team:
                worker.end()


class RemoteEnv:
    """An environment in a worker process, with the methods that an episode needs.

    An exception in the worker process is raised here again, with its file and line.

    Attributes:
        lost: the exception that ended the environment, None while it can be used.
        details: er-gym's own objects of the last step: :class:`er_gym.envs.info.Details`.

    Raises:
        EnvLost: the process died or got stuck; from any method but ``close``.
    """

    def __init__(self, pool: EnvPool, worker: EnvWorker, slot: int) -> None:
        self.lost: EnvLost | None = None
        self._pool, self._worker, self._slot = pool, worker, slot
        self._task: Any = None
        self.details: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode of ``options["task"]``."""
        if options is None:
            raise ValueError("no task is given; state one: options={'task': TASK}")
        self._task = options["task"]
        obs, info, details = self._ask("reset", seed, options)
        self.details = {"task": self._task, **details}
        return obs, info

    def step(
        self, action: Action | str | int
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Do an action, as ``EmbodiedEnv.step`` does."""
        *answer, details = self._ask("step", action)
        self.details = {"task": self._task, **details}
        obs, reward, terminated, truncated, info = answer
        return obs, reward, terminated, truncated, info

    def snapshot(self) -> bytes:
        """The episode as it is now, as ``EmbodiedEnv.snapshot`` gives it."""
        saved: bytes = self._ask("snapshot")
        return saved

    def restore(self, task: Task, snapshot: bytes) -> tuple[dict[str, Any], dict[str, Any]]:
        """Go on with the episode of a snapshot, which is of this task."""
        self._task = task
        obs, info, details = self._ask("restore", snapshot)
        self.details = {"task": task, **details}
        return obs, info

    @property
    def unwrapped(self) -> RemoteEnv:
        """This environment."""
        return self

    def close(self) -> None:
        """Close the environment; :meth:`EnvPool.env` makes another."""
        with contextlib.suppress(EnvLost):
            self._ask("close")

    def _ask(self, method: str, *args: Any) -> Any:
        request = request_to(method, *args)
        try:
            return result_of(self._worker.ask(self._slot, request, self._pool.deadline))
        except EnvLost as lost:
            self.lost = lost
            raise
