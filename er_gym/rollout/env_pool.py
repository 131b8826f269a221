"""Environments in worker processes, for threads of this process: a pipe each, several per process.

:mod:`er_gym.rollout.worker_pool` plays whole episodes in other processes. Here the agent stays in
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
from types import TracebackType
from typing import Any

from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.processes import CONTEXT, end_processes, start_process
from er_gym.rollout.worker_pool import WorkerSetupError

_PROTOCOL = 5
"""Pickle's: takes half as long for pictures as what ``Connection.send`` uses."""
_NOBODY = -1
DEADLINE_SECONDS = 600.0
"""Seconds after which an environment that has not answered is taken for stuck."""


class EnvLost(Exception):
    """The process that an environment was in is gone; :meth:`EnvPool.env` gives another.

    Attributes:
        exitcode: of the process; minus the signal's number if a signal ended it.
        at_fault: whether it died while it was at work on this environment, or on none at all: a
            neighbour of one that kills its process is not to blame.
    """

    def __init__(self, exitcode: int | None, at_fault: bool) -> None:
        super().__init__(f"the worker process died with exit code {exitcode}")
        self.exitcode = exitcode
        self.at_fault = at_fault


class EnvPool:
    """``slots`` environments in ``workers`` spawned processes; use it in a ``with`` statement.

    Slot ``i`` is in process ``i % workers``. A process that dies is started anew when one of its
    slots is next asked for. Processes ignore Ctrl-C, and end when this process does, however it
    ends.

    Args:
        workers: how many processes, at least 1; no more are started than there are slots.
        slots: how many environments.
        env: the keyword arguments of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
        deadline: seconds; a process that leaves a question unanswered for so long is killed.

    Attributes:
        closed: whether it has been left, and the processes have ended or are about to.
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
        self._lock = threading.Lock()  # starting and burying processes
        self._team: list[_Worker] = []

    def __enter__(self) -> EnvPool:
        try:
            for place in range(self._workers):
                self._team.append(self._start(place))
        except BaseException:  # Ctrl-C too
            self._close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._close()

    def env(self, slot: int) -> RemoteEnv:
        """The environment of a slot, to be used by one thread; made if it is not there.

        Raises:
            WorkerSetupError: it cannot be made.
            EnvLost: the process died of making it, or all has been closed.
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

    def _bury(self, worker: _Worker, slot: int, stuck: bool) -> EnvLost:
        """End a process that is of no use any more, and say what its end was."""
        with self._lock:
            if stuck:
                worker.process.kill()
            end_processes([worker.process])
        at_fault = worker.serving.value in (slot, _NOBODY)
        return EnvLost(worker.process.exitcode, at_fault)

    def _close(self) -> None:
        with self._lock:
            self.closed = True
            for worker in self._team:
                worker.process.terminate()
            # Pipes are left open: another thread may be reading from one, and sees it end.
            end_processes(worker.process for worker in self._team)


class RemoteEnv:
    """What is needed of an environment to play an episode; the environment is elsewhere.

    What it raises is raised here too, as from there.

    Attributes:
        lost: what ended it, None while it can be used.

    Raises:
        EnvLost: its process died or got stuck; at any method but ``close``.
    """

    def __init__(self, engines: EnvPool, worker: _Worker, slot: int) -> None:
        self.lost: EnvLost | None = None
        self._engines, self._worker, self._slot = engines, worker, slot
        self._pipe = worker.pipes[slot]
        self._task: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin the episode that ``options["task"]`` states."""
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
        question = pickle.dumps((method, args), _PROTOCOL)
        stuck, told = False, b""
        with contextlib.suppress(EOFError, OSError):  # the process is gone
            self._pipe.send_bytes(question)
            stuck = not self._pipe.poll(self._engines.deadline)
            if not stuck:
                told = self._pipe.recv_bytes()
        if not told:
            self.lost = self._engines._bury(self._worker, self._slot, stuck)
            raise self.lost
        answer = pickle.loads(told)
        if isinstance(answer, _Raised):
            answer.again()
        return answer


class _Worker:
    """A process, and the pipes to it.

    Attributes:
        pipes: by slot.
        serving: the slot that the process is at work on now, :data:`_NOBODY` for none; in memory
            that outlives it.
    """

    def __init__(self, slots: Sequence[int], env: Mapping[str, Any]) -> None:
        pairs = {slot: CONTEXT.Pipe() for slot in slots}
        self.pipes = {slot: ours for slot, (ours, _) in pairs.items()}
        self.serving = CONTEXT.RawValue("i", _NOBODY)
        theirs = {slot: pipe for slot, (_, pipe) in pairs.items()}
        self.process = start_process(_serve, theirs, env, self.serving)
        # With our copies closed, the pipes end when the process does.
        for pipe in theirs.values():
            pipe.close()


# -- in the worker process -----------------------------------------------------------------------


@dataclass(frozen=True)
class _Raised:
    """What was raised over there, and where."""

    error: Exception
    file: str
    line: int

    @classmethod
    def caught(cls, error: Exception) -> _Raised:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        try:
            pickle.loads(pickle.dumps(error, _PROTOCOL))
        except Exception:  # anything may be in an exception, and its class may take any arguments
            error = RuntimeError(f"{type(error).__name__}: {error}")
        return cls(error, frame.filename, frame.lineno or 1)

    def again(self) -> None:
        """Raise it here, with a traceback that ends where it was raised."""
        there = compile("\n" * (self.line - 1) + "raise error", self.file, "exec")
        exec(there, {"error": self.error})


class _Seat:
    """A slot's environment, if there is one."""

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
    """The caller has it."""
    return {name: value for name, value in info.items() if name != "task"}


def _serve(pipes: Mapping[int, Connection], env: Mapping[str, Any], serving: Any) -> None:
    """The worker process: one question after the other, until no pipe has another end."""
    seats = {slot: _Seat(env) for slot in pipes}
    there = dict(pipes)
    try:
        while there:
            ready = wait(list(there.values()))
            for slot, pipe in list(there.items()):
                if pipe not in ready:
                    continue
                try:
                    question = pipe.recv_bytes()
                    serving.value = slot
                    pipe.send_bytes(_answer(seats[slot], question))
                except (EOFError, OSError):
                    del there[slot]
                serving.value = _NOBODY
    finally:
        for seat in seats.values():
            with contextlib.suppress(Exception):
                seat.close()


def _answer(seat: _Seat, question: bytes) -> bytes:
    try:
        method, args = pickle.loads(question)
        return pickle.dumps(getattr(seat, method)(*args), _PROTOCOL)
    except Exception as error:  # whatever it is, the one who asked must hear of it
        return pickle.dumps(_Raised.caught(error), _PROTOCOL)
