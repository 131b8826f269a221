"""A Ray cluster, as the rest of er-gym sees it."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Generator, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import ray

from er_gym.rollout.cluster.actor_pool import ActorOptions, ActorPool
from er_gym.rollout.cluster.env_worker import RayEnvWorker
from er_gym.rollout.cluster.settings import RaySettings
from er_gym.rollout.env_worker import EnvWorker
from er_gym.rollout.worker_pool import LostJob

Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclass(frozen=True)
class RayBackend:
    """The nodes of a cluster that this process has joined; see
    :class:`er_gym.rollout.worker_backend.WorkerBackend`.

    Attributes:
        settings: how they are used.
        say: called with messages for the user, from any thread.
    """

    settings: RaySettings
    say: Callable[[str], None] = field(compare=False)

    @property
    def is_local(self) -> bool:
        return not self.settings.address

    @property
    def shares_files(self) -> bool:
        return self.is_local or self.settings.shared_files

    @property
    def capacity(self) -> int:
        """How many workers the cluster's present nodes have processors for, at least 1."""
        has: dict[str, float] = ray.cluster_resources()  # type: ignore[no-untyped-call]
        return max(1, math.floor(has.get("CPU", 0) / (self.settings.cpus or 1) + 1e-6))

    def run_jobs(
        self,
        make: Callable[[], Callable[[Job], Result]],
        jobs: Iterable[Job],
        *,
        workers: int,
        tries: int = 3,
        affinity_key: Callable[[Job], Hashable] | None = None,
    ) -> Generator[tuple[Job, Result | LostJob], None, None]:
        if workers < 1:
            raise ValueError(f"workers is {workers}; give a whole number from 1")
        affinity_key = affinity_key or (lambda job: None)
        pool = ActorPool(
            self._options, make, jobs, workers=workers, tries=tries, affinity_key=affinity_key
        )
        return pool.results()

    def start_env_worker(self, slots: Sequence[int], env: Mapping[str, Any]) -> EnvWorker:
        return RayEnvWorker(self._options, slots, env)

    @property
    def _options(self) -> ActorOptions:
        ray_options = {
            "num_cpus": self.settings.cpus,
            "memory": self.settings.memory,
            "max_restarts": 0,  # the pool replaces actors, since only it knows their jobs
            "max_task_retries": 0,
        }
        path = tuple(sys.path) if self.shares_files else ()
        return ActorOptions(ray_options, self.settings.memory, path, self.say)
