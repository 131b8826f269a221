"""A pool of environments in worker processes, for agents in threads of this process.

Each environment has a pipe of its own, and a process holds several environments. Unlike
:mod:`er_gym.rollout.worker_pool`, which plays whole episodes in other processes, the agent stays in
this process, because it mostly waits for a server's reply. Only the engine, which needs a core and
memory, runs elsewhere.
"""

from __future__ import annotations

import contextlib
import pickle
import threading
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.processes import CONTEXT, end_processes, start_process
from er_gym.rollout.worker_pool import WorkerSetupError

_PROTOCOL = 5
"""Pickle's protocol. For pictures it is twice as fast as that of ``Connection.send``."""
_NO_SLOT = -1
DEADLINE_SECONDS = 600.0
"""Seconds after which an environment that has not answered counts as stuck."""


class EnvLost(Exception):
    """The worker process of an environment is gone; :meth:`EnvPool.env` gives another environment.

    Attributes:
        exitcode: the exit code of the process; minus the signal's number if a signal ended it.
        at_fault: whether this environment may have killed the process: the process died while it
            worked on this environment, or on none. It is False for the neighbours of the culprit.
    """

    def __init__(self, exitcode: int | None, at_fault: bool) -> None:
        super().__init__(f"the worker process died with exit code {exitcode}")
        self.exitcode = exitcode
        self.at_fault = at_fault


class EnvPool:
    """``slots`` environments in ``workers`` spawned processes; use it in a ``with`` statement.

    Slot ``i`` is in process ``i % workers``. A process that has died is started again when one of
    its slots is next used. Processes ignore Ctrl-C. They end when this process ends, in any way.

    Args:
        workers: the number of processes, at least 1; at most one for each slot is started.
        slots: the number of environments.
        env: the keyword arguments of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
        deadline: seconds; a process that leaves a request unanswered for longer is killed.

    Attributes:
        closed: whether the ``with`` statement has ended, so that the processes end or have ended.
    """

    def __init__(
        self,
        workers: int,
        slots: int,
        env: Mapping[str, Any],
        *,
        deadline: float = DEADLINE_SECONDS,
    ) -> None:
        self.deadline = deadline
        self.closed = False
        self._workers, self._slots = min(workers, slots), slots
        self._kwargs = dict(env)
        self._lock = threading.Lock()  # guards starting and ending processes
        self._team: list[_Worker] = []

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
                raise EnvLost(self._team[place].process.exitcode, at_fault=False)
            if not self._team[place].process.is_alive():
                self._team[place] = self._start(place)
            env = RemoteEnv(self, self._team[place], slot)
        try:
            env._ask("make")
        except EnvLost:
            raise
        except Exception as error:
            raise WorkerSetupError(f"{type(error).__name__}: {error}") from error
        return env

    def _start(self, place: int) -> _Worker:
        return _Worker(range(place, self._slots, self._workers), self._kwargs)

    def _end(self, worker: _Worker, slot: int, stuck: bool) -> EnvLost:
        """End a dead or stuck process, and return the exception for its environment."""
        with self._lock:
            if stuck:
                worker.process.kill()
            end_processes([worker.process])
        at_fault = worker.serving.value in (slot, _NO_SLOT)
        return EnvLost(worker.process.exitcode, at_fault)

    def _close(self) -> None:
        with self._lock:
            self.closed = True
            for worker in self._team:
                worker.process.terminate()
            # Pipes are left open: another thread may be reading from one, and sees it end.
            end_processes(worker.process for worker in self._team)


class RemoteEnv:
    """An environment in a worker process, with the methods that an episode needs.

    An exception in the worker process is raised here again, with its file and line.

    Attributes:
        lost: the exception that ended the environment, None while it can be used.

    Raises:
        EnvLost: the process died or got stuck; from any method but ``close``.
    """

    def __init__(self, pool: EnvPool, worker: _Worker, slot: int) -> None:
        self.lost: EnvLost | None = None
        self._pool, self._worker, self._slot = pool, worker, slot
        self._pipe = worker.pipes[slot]
        self._task: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode of ``options["task"]``."""
        if options is None:
            raise ValueError("no task is given; state one: options={'task': TASK}")
        self._task = options["task"]
        obs, info = self._ask("reset", seed, options)
        return obs, {"task": self._task, **info}

    def step(
        self, action: Action | str | int
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Do an action, as ``EmbodiedEnv.step`` does."""
        obs, reward, terminated, truncated, info = self._ask("step", action)
        return obs, reward, terminated, truncated, {"task": self._task, **info}

    def close(self) -> None:
        """Close the environment; :meth:`EnvPool.env` makes another."""
        with contextlib.suppress(EnvLost):
            self._ask("close")

    def _ask(self, method: str, *args: Any) -> Any:
        request = pickle.dumps((method, args), _PROTOCOL)
        stuck, answer_bytes = False, b""
        with contextlib.suppress(EOFError, OSError):  # the process is gone
            self._pipe.send_bytes(request)
            stuck = not self._pipe.poll(self._pool.deadline)
            if not stuck:
                answer_bytes = self._pipe.recv_bytes()
        if not answer_bytes:
            self.lost = self._pool._end(self._worker, self._slot, stuck)
            raise self.lost
        answer = pickle.loads(answer_bytes)
        if isinstance(answer, _Raised):
            answer.again()
        return answer


class _Worker:
    """A process, and the pipes to it.

    Attributes:
        pipes: the pipes by slot.
        serving: the slot that the process works on now, :data:`_NO_SLOT` for none. It is in shared
            memory, which outlives the process.
    """

    def __init__(self, slots: Sequence[int], env: Mapping[str, Any]) -> None:
        pairs = {slot: CONTEXT.Pipe() for slot in slots}
        self.pipes = {slot: ours for slot, (ours, _) in pairs.items()}
        self.serving = CONTEXT.RawValue("i", _NO_SLOT)
        theirs = {slot: pipe for slot, (_, pipe) in pairs.items()}
        self.process = start_process(_serve, theirs, env, self.serving)
        # With our copies closed, the pipes end when the process does.
        for pipe in theirs.values():
            pipe.close()


# -- in the worker process -----------------------------------------------------------------------


@dataclass(frozen=True)
class _Raised:
    """An exception of the worker process, with the file and line that raised it."""

    error: Exception
    file: str
    line: int

    @classmethod
    def caught(cls, error: Exception) -> _Raised:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        try:
            pickle.loads(pickle.dumps(error, _PROTOCOL))
        except Exception:  # an exception may hold anything, and its class may take any arguments
            error = RuntimeError(f"{type(error).__name__}: {error}")
        return cls(error, frame.filename, frame.lineno or 1)

    def again(self) -> None:
        """Raise the exception here, with a traceback that ends at its origin."""
        there = compile("\n" * (self.line - 1) + "raise error", self.file, "exec")
        exec(there, {"error": self.error})


class _SlotEnv:
    """The environment of a slot, if it has been made."""

    def __init__(self, env: Mapping[str, Any]) -> None:
        self._kwargs = env
        self._env: EmbodiedEnv | None = None

    def make(self) -> None:
        if self._env is None:
            self._env = EmbodiedEnv((), **self._kwargs)

    def reset(self, seed: int | None, options: dict[str, Any]) -> Any:
        obs, info = self._made.reset(seed=seed, options=options)
        return obs, _without_task(info)

    def step(self, action: Action | str | int) -> Any:
        *rest, info = self._made.step(action)
        return *rest, _without_task(info)

    def close(self) -> None:
        env, self._env = self._env, None
        if env is not None:
            env.close()

    @property
    def _made(self) -> EmbodiedEnv:
        assert self._env is not None, "asked before it was made"
        return self._env


def _without_task(info: dict[str, Any]) -> dict[str, Any]:
    """``info`` without its task, which the caller has already."""
    return {name: value for name, value in info.items() if name != "task"}


def _serve(pipes: Mapping[int, Connection], env: Mapping[str, Any], serving: Any) -> None:
    """Run the worker process: answer requests until the other ends of all pipes are closed."""
    slot_envs = {slot: _SlotEnv(env) for slot in pipes}
    open_pipes = dict(pipes)
    try:
        while open_pipes:
            ready = wait(list(open_pipes.values()))
            for slot, pipe in list(open_pipes.items()):
                if pipe not in ready:
                    continue
                try:
                    request = pipe.recv_bytes()
                    serving.value = slot
                    answer = _answer(slot_envs[slot], request)
                    serving.value = _NO_SLOT  # first: an answered slot is not to blame
                    pipe.send_bytes(answer)
                except (EOFError, OSError):
                    del open_pipes[slot]
                serving.value = _NO_SLOT
    finally:
        for slot_env in slot_envs.values():
            with contextlib.suppress(Exception):
                slot_env.close()


def _answer(slot_env: _SlotEnv, request: bytes) -> bytes:
    try:
        method, args = pickle.loads(request)
        return pickle.dumps(getattr(slot_env, method)(*args), _PROTOCOL)
    except Exception as error:  # the caller raises it
        return pickle.dumps(_Raised.caught(error), _PROTOCOL)
