"""Worker processes with environments for the agents of another process.

A worker holds the environments of several slots of an :class:`.env_pool.EnvPool`, and answers one
request at a time. Requests and answers are pickled here, so that whatever carries them need not
look inside.
"""

from __future__ import annotations

import contextlib
import pickle
import threading
import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.processes import CONTEXT, end_processes, start_process

_PROTOCOL = 5
"""Pickle's protocol. For pictures it is twice as fast as that of ``Connection.send``."""
_NO_SLOT = -1


class EnvLost(Exception):
    """The worker process of an environment is gone; :meth:`.EnvPool.env` gives another environment.

    Attributes:
        exitcode: the exit code of the process, minus the signal's number if a signal ended it; None
            if it is unknown.
        at_fault: whether this environment may have killed the process: the process died while it
            worked on this environment, or on none. It is False for the other environments of the
        process. why: what is known beyond the exit code.
    """

    def __init__(self, exitcode: int | None, at_fault: bool, why: str = "") -> None:
        super().__init__(why or f"the worker process died with exit code {exitcode}")
        self.exitcode = exitcode
        self.at_fault = at_fault
        self.why = why


class EnvWorker(Protocol):
    """A worker process, as the :class:`.EnvPool` sees it; safe for threads."""

    @property
    def alive(self) -> bool:
        """Whether the worker still runs."""

    def ask(self, slot: int, request: bytes, deadline: float) -> bytes:
        """Its answer to a request (:func:`request_to`) for the environment of a slot.

        Raises:
            EnvLost: the process died, or did not answer within ``deadline`` seconds.
        """

    def dismiss(self) -> None:
        """Tell the worker to end; :meth:`ask` raises EnvLost from then on."""

    def end(self) -> EnvLost:
        """Wait until it has ended, by force if it takes long; says how it ended."""


class LocalEnvWorker:
    """A spawned process of this machine; see :class:`EnvWorker`.

    Args:
        slots: the slots whose environments it holds.
        env: the keyword arguments of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
    """

    def __init__(self, slots: Sequence[int], env: Mapping[str, Any]) -> None:
        pairs = {slot: CONTEXT.Pipe() for slot in slots}
        self._pipes = {slot: ours for slot, (ours, _) in pairs.items()}
        self._ending = threading.Lock()
        # The slot that the process works on; in shared memory, which outlives the process.
        self._serving = CONTEXT.RawValue("i", _NO_SLOT)
        theirs = {slot: pipe for slot, (_, pipe) in pairs.items()}
        self.process = start_process(_serve, theirs, env, self._serving)
        # With our copies closed, the pipes end when the process does.
        for pipe in theirs.values():
            pipe.close()

    @property
    def alive(self) -> bool:
        return self.process.is_alive()

    def ask(self, slot: int, request: bytes, deadline: float) -> bytes:
        pipe, stuck = self._pipes[slot], False
        with contextlib.suppress(EOFError, OSError):  # the process is gone
            pipe.send_bytes(request)
            stuck = not pipe.poll(deadline)
            if not stuck:
                return pipe.recv_bytes()
        if stuck:
            self.process.kill()
        lost = self.end()
        raise EnvLost(lost.exitcode, at_fault=self._serving.value in (slot, _NO_SLOT))

    def dismiss(self) -> None:
        # Pipes are left open: another thread may be reading from one, and sees it end.
        self.process.terminate()

    def end(self) -> EnvLost:
        with self._ending:  # two threads must not wait for one process
            end_processes([self.process])
        return EnvLost(self.process.exitcode, at_fault=False)


def request_to(method: str, *args: Any) -> bytes:
    """A request: the name of a method of :class:`_SlotEnv`, and its arguments."""
    return pickle.dumps((method, args), _PROTOCOL)


def result_of(answer: bytes) -> Any:
    """What an answer holds; an exception of the worker process is raised here again, with its file
    and line."""
    result = pickle.loads(answer)
    if isinstance(result, _Raised):
        result.again()
    return result


# -- in the worker process -----------------------------------------------------------------------


class EnvServer:
    """The environments of some slots, in the worker process.

    Args:
        slots: the slots.
        env: the keyword arguments of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
    """

    def __init__(self, slots: Sequence[int], env: Mapping[str, Any]) -> None:
        self._envs = {slot: _SlotEnv(env) for slot in slots}

    def answer(self, slot: int, request: bytes) -> bytes:
        """The answer to a request; what the environment raises is an answer, too."""
        try:
            method, args = pickle.loads(request)
            return pickle.dumps(getattr(self._envs[slot], method)(*args), _PROTOCOL)
        except Exception as error:  # the caller raises it
            return pickle.dumps(_Raised.caught(error), _PROTOCOL)

    def close(self) -> None:
        """Close the environments."""
        for each in self._envs.values():
            with contextlib.suppress(Exception):
                each.close()


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
        return obs, info, self._details()

    def step(self, action: Action | str | int) -> Any:
        return *self._made.step(action), self._details()

    def snapshot(self) -> bytes:
        return self._made.snapshot()

    def restore(self, snapshot: bytes) -> Any:
        obs, info = self._made.restore(snapshot)
        return obs, info, self._details()

    def _details(self) -> dict[str, Any]:
        """The details without the task, which the caller has already."""
        return {name: each for name, each in self._made.details.items() if name != "task"}

    def close(self) -> None:
        env, self._env = self._env, None
        if env is not None:
            env.close()

    @property
    def _made(self) -> EmbodiedEnv:
        assert self._env is not None, "asked before it was made"
        return self._env


def _serve(pipes: Mapping[int, Connection], env: Mapping[str, Any], serving: Any) -> None:
    """Run the worker process: answer requests until the other ends of all pipes are closed."""
    server = EnvServer([*pipes], env)
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
                    answer = server.answer(slot, request)
                    serving.value = _NO_SLOT  # first: an answered slot is not to blame
                    pipe.send_bytes(answer)
                except (EOFError, OSError):
                    del open_pipes[slot]
                serving.value = _NO_SLOT
    finally:
        server.close()
