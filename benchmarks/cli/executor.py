"""Where a command's worker processes run: ``--workers``, ``--executor`` and what Ray needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import BadInput, bad_input, entered
from benchmarks.cli.options import Finite, OptionGroup, Words, option, with_options, workers_type

if TYPE_CHECKING:
    from er_gym.rollout.executor import Parallelism
    from er_gym.rollout.worker_backend import WorkerBackend

EXECUTORS = ("local", "ray")
_GIB = 2**30


@dataclass(frozen=True)
class Workforce:
    """The workers of a command.

    Attributes:
        worker_backend: where they run.
        workers: the largest number of them.
    """

    worker_backend: WorkerBackend
    workers: int

    def parallelism(self, concurrency: int = 1) -> Parallelism:
        """The workers for a run with so many episodes at once, where one process plays several."""
        from er_gym.rollout.executor import Parallelism

        return Parallelism(self.workers, concurrency, worker_backend=self.worker_backend)

    def must_see(self, path: Path) -> None:
        """Raise BadInput if workers of other nodes cannot read a file or folder of this machine."""
        if not self.worker_backend.shares_files:
            raise BadInput(
                f"the workers read {path}, which other nodes may not have; put it where all nodes "
                "see it and give --shared-dir"
            )


@dataclass(frozen=True)
class ExecutorOptions(OptionGroup):
    """The options that say where worker processes run; None if one was not given.

    Raises:
        BadInput: options do not go together; the message says which.
    """

    workers: int | None = None
    executor: str | None = option(
        type=click.Choice(EXECUTORS),
        help="Where the workers are: processes of this machine, or a Ray cluster.  "
        "[default: local]",
    )
    ray_address: str | None = option(
        type=Words(),
        metavar="ADDRESS",
        help="The cluster: auto, HOST:PORT or ray://HOST:PORT.  [default: start Ray here]",
    )
    shared_dir: bool = option(
        is_flag=True,
        help="Every node of the cluster sees this machine's files under the same paths.",
    )
    worker_cpus: float | None = option(
        type=Finite(min=0),
        help="The processors that a worker requests from the cluster.  [default: 1]",
    )
    worker_memory: float | None = option(
        type=Finite(min=0.0625),
        metavar="GIB",
        help="The memory that a worker requests from the cluster; a worker that uses more is "
        "replaced.  [default: 1]",
    )

    def __post_init__(self) -> None:
        for_ray = [flag for flag in self.given if flag != "--executor"]
        if for_ray and self.executor != "ray":
            raise BadInput(f"{for_ray[0]} is for --executor ray")
        if self.shared_dir and not self.ray_address:
            raise BadInput(
                "--shared-dir is for --ray-address; a Ray on this machine sees its files anyway"
            )

    def arguments(self) -> list[str]:
        """The same options but for --workers, for another command."""
        values = {flag: getattr(self, flag[2:].replace("-", "_")) for flag in self.given}
        return [
            word
            for flag, value in values.items()
            for word in ([flag] if value is True else [flag, str(value)])
        ]

    @contextmanager
    def workforce(
        self, say: Callable[[str], None], default: int, *, agents: Iterable[str] = ()
    ) -> Iterator[Workforce]:
        """The workers, for the length of a ``with`` statement.

        Args:
            say: called with messages for the user, from any thread.
            default: how many there are without --workers on this machine; a cluster has as many as
                it has processors for.
            agents: names of agents whose modules the workers need.

        Raises:
            BadInput: there is no such cluster.
        """
        from er_gym.rollout.worker_backend import LOCAL_BACKEND

        if self.executor != "ray":
            yield Workforce(LOCAL_BACKEND, self.workers or default)
            return
        from er_gym.rollout.cluster.modules import modules_of
        from er_gym.rollout.cluster.session import ray_backend
        from er_gym.rollout.cluster.settings import RaySettings

        with bad_input():
            settings = RaySettings(
                address=self.ray_address or "",
                cpus=1.0 if self.worker_cpus is None else self.worker_cpus,
                memory=int((self.worker_memory or 1.0) * _GIB),
                shared_files=self.shared_dir,
            )
        with entered(lambda: ray_backend(settings, say, modules_of(agents))) as worker_backend:
            yield Workforce(worker_backend, self.workers or worker_backend.capacity)


def with_executor_options(
    default: int | None = None, *, workers: bool = True
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add these options to a command, which gets them as one argument ``executor_options``.

    Args:
        default: the number of workers; None for one for each processor.
        workers: whether the command has --workers; others have the number elsewhere.
    """
    shown = "one for each processor" if default is None else str(default)
    number = click.option(
        "--workers", type=workers_type, help=f"The number of processes.  [default: {shown}]"
    )

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        command = with_options(executor_options=ExecutorOptions)(command)
        return number(command) if workers else command

    return add


def processors() -> int:
    """How many processors this machine has."""
    return os.cpu_count() or 1
