"""Where worker processes run: on this machine, or on a cluster.

Everything that needs worker processes asks a :class:`WorkerBackend` for them.
:data:`LOCAL_BACKEND` has processes of its own;
:class:`er_gym.rollout.cluster.worker_backend.RayBackend` has Ray's.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from er_gym.rollout.env_worker import EnvWorker, LocalEnvWorker
from er_gym.rollout.worker_pool import LostJob, run_jobs

Job = TypeVar("Job")
Result = TypeVar("Result")


class WorkerBackend(Protocol):
    """Where worker processes run; hashable and cheap to hold."""

    @property
    def is_local(self) -> bool:
        """Whether all workers are on this machine, so that they may append to a file at once."""

    @property
    def shares_files(self) -> bool:
        """Whether workers find the same files under the same absolute paths as this process."""

    def run_jobs(
        self,
        make: Callable[[], Callable[[Job], Result]],
        jobs: Iterable[Job],
        *,
        workers: int,
        tries: int = 3,
        affinity_key: Callable[[Job], Hashable] | None = None,
    ) -> Generator[tuple[Job, Result | LostJob], None, None]:
        """Do every job in a worker process; see :func:`.worker_pool.run_jobs`.

        Args:
            make: as there.
            jobs: as there.
            workers: as there.
            tries: as there.
            affinity_key: of a job, such as its room: jobs with the same key go to one worker where
                that costs no time.
        """

    def start_env_worker(self, slots: Sequence[int], env: Mapping[str, Any]) -> EnvWorker:
        """Start a worker process for the environments of some slots of an
        :class:`.env_pool.EnvPool`."""


@dataclass(frozen=True)
class _LocalBackend:
    """Spawned processes of this machine; see :class:`WorkerBackend`."""

    is_local = True
    shares_files = True

    def run_jobs(
        self,
        make: Callable[[], Callable[[Job], Result]],
        jobs: Iterable[Job],
        *,
        workers: int,
        tries: int = 3,
        affinity_key: Callable[[Job], Hashable] | None = None,
    ) -> Generator[tuple[Job, Result | LostJob], None, None]:
        """All rooms fit into the memory of each process, so ``affinity_key`` changes nothing."""
        return run_jobs(make, jobs, workers=workers, tries=tries)

    def start_env_worker(self, slots: Sequence[int], env: Mapping[str, Any]) -> EnvWorker:
        return LocalEnvWorker(slots, env)


LOCAL_BACKEND: WorkerBackend = _LocalBackend()
