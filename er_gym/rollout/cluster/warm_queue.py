"""A queue of jobs that gives a worker jobs of the room that it has already loaded."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterable
from typing import Generic, TypeVar

Job = TypeVar("Job")


class WarmQueue(Generic[Job]):
    """Jobs by affinity key. Those of one key keep their order.

    Args:
        jobs: the jobs.
        affinity_key: of a job.
    """

    def __init__(self, jobs: Iterable[Job], affinity_key: Callable[[Job], Hashable]) -> None:
        self._affinity_key = affinity_key
        self._by_key: dict[Hashable, deque[Job]] = {}
        self._first: deque[Job] = deque()
        self._length = 0
        for job in jobs:
            self._by_key.setdefault(affinity_key(job), deque()).append(job)
            self._length += 1

    def __len__(self) -> int:
        return self._length

    @property
    def has_first(self) -> bool:
        """Whether the next job was added by :meth:`put_first`."""
        return bool(self._first)

    def put_first(self, job: Job) -> None:
        """Add a job that the next worker gets, whatever its room."""
        self._first.append(job)
        self._length += 1

    def take(
        self, most: int, key: Hashable, others: Iterable[Hashable] = ()
    ) -> tuple[Hashable, list[Job]]:
        """Take up to ``most`` jobs of one key; one job, if it was put first.

        Args:
            most: from 1.
            key: the affinity key of the jobs that the worker did before; preferred.
            others: the keys of other workers; avoided while there are more.

        Raises:
            IndexError: the queue is empty.
        """
        if self._first:
            self._length -= 1
            job = self._first.popleft()
            return self._affinity_key(job), [job]
        if key not in self._by_key:
            key = self._next_key(frozenset(others))
        jobs = self._by_key[key]
        taken = [jobs.popleft() for _ in range(min(most, len(jobs)))]
        if not jobs:
            del self._by_key[key]
        self._length -= len(taken)
        return key, taken

    def _next_key(self, others: frozenset[Hashable]) -> Hashable:
        """The first key that nobody has warm; else the one with the most jobs."""
        if not self._by_key:
            raise IndexError("there are no more jobs")
        free = next((key for key in self._by_key if key not in others), None)
        if free is not None:
            return free
        return max(self._by_key, key=lambda each: len(self._by_key[each]))
