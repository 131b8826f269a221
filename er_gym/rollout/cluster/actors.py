"""What runs on the cluster's nodes: plain classes, which :func:`start_actor` makes Ray actors."""

from __future__ import annotations

import contextlib
import os
import pickle
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from er_gym.rollout.cluster.origin import Origin, missing_there
from er_gym.rollout.env_worker import EnvServer

_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


@dataclass(frozen=True)
class Begun:
    """A worker is ready.

    Attributes:
        node: the id of its node.
        problem: why it is not, in one line; then nothing else is asked of it.
    """

    node: str
    problem: str = ""


@dataclass(frozen=True)
class Done:
    """The results of a batch of jobs.

    Attributes:
        results: of its jobs, in order.
        seconds: how long it took.
        memory: the worker's resident memory, bytes.
    """

    results: Sequence[Any]
    seconds: float
    memory: int


def start_actor(kind: type, options: Mapping[str, Any], *args: Any) -> Any:
    """Start an actor of a class with Ray's options; returns its handle at once."""
    import ray

    return ray.remote(kind).options(**options).remote(*args)


class JobActor:
    """Does jobs, with the function that :meth:`begin` makes."""

    def __init__(self) -> None:
        self._do: Callable[[Any], Any] | None = None

    def begin(self, driver: Origin, path: Sequence[str], make: bytes) -> Begun:
        """Make the function that does the jobs.

        Args:
            driver: the process that sends the jobs.
            path: where else to look for modules.
            make: a pickled function that returns it.
        """
        sys.path += [each for each in path if each not in sys.path]
        problem = _misfit(driver)
        if not problem:
            try:
                self._do = pickle.loads(make)()
            except ImportError as error:
                problem = missing_there(Origin.here(), error)
            except (Exception, SystemExit) as error:  # the driver raises it
                problem = f"{type(error).__name__}: {error}"
        return Begun(_node(), problem)

    def do(self, pickled_jobs: bytes) -> Done:
        """Do jobs, one after another.

        Args:
            pickled_jobs: a sequence of them. Ray's own pickling takes several times as long.
        """
        assert self._do is not None, "asked before it began"
        jobs = pickle.loads(pickled_jobs)
        start = time.perf_counter()
        results = [self._do(job) for job in jobs]
        return Done(results, time.perf_counter() - start, resident_memory())

    def close(self) -> None:
        """Close the function that did the jobs."""
        with contextlib.suppress(Exception):
            getattr(self._do, "close", lambda: None)()


class EnvActor:
    """Holds environments of an :class:`~er_gym.rollout.env_pool.EnvPool`."""

    def __init__(self) -> None:
        self._server: EnvServer | None = None

    def begin(self, driver: Origin, slots: Sequence[int], env: Mapping[str, Any]) -> Begun:
        """Say for which slots, and how environments are made."""
        problem = _misfit(driver)
        if not problem:
            self._server = EnvServer(slots, env)
        return Begun(_node(), problem)

    def answer(self, slot: int, request: bytes) -> bytes:
        """See :meth:`er_gym.rollout.env_worker.EnvServer.answer`."""
        assert self._server is not None, "asked before it began"
        return self._server.answer(slot, request)


def resident_memory() -> int:
    """The resident memory of this process, bytes; 0 if the system does not report it."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * _PAGE_BYTES
    except (OSError, ValueError, IndexError):
        return 0


def _misfit(driver: Origin) -> str:
    return driver.misfit(Origin.here())


def _node() -> str:
    import ray

    return str(ray.get_runtime_context().get_node_id())
