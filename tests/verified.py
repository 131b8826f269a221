"""Verifies a collection in this process, as ``er-gym data verify`` does in others."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.cli.data import reenact_of
from er_gym.data.collection import Collection
from er_gym.data.reenactment import NOBODY
from er_gym.data.verify import verify
from er_gym.tasks.task import Task


class Here:
    """Does every job in this process; a :class:`er_gym.rollout.worker_backend.WorkerBackend`."""

    is_local = shares_files = True

    def run_jobs(self, make: Any, jobs: Iterable[Any], **how: Any) -> Generator[Any, None, None]:
        """See :func:`er_gym.rollout.worker_pool.run_jobs`."""
        worker = make()
        yield from ((job, worker(job)) for job in jobs)
        worker.close()


def problems(
    folder: Path, tasks: Sequence[Task], *, pictures: bool = True, agents: bool = True
) -> list[str]:
    """What is wrong with the trajectories of a collection, each line with their id.

    Args:
        folder: the collection's.
        tasks: the suite's.
        pictures: whether their files are compared.
        agents: whether the agents decide anew; without them, ``er_gym.data`` alone checks.
    """
    collection = Collection.open(folder)
    backend: Any = Here()
    reenact = reenact_of(collection, tasks) if agents else NOBODY
    verdicts = verify(collection, tasks, pictures=pictures, worker_backend=backend, reenact=reenact)
    return [f"{one.id}: {problem}" for one in verdicts for problem in one.problems]
