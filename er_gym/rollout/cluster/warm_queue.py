"""A queue of jobs that gives a worker jobs of the room that it has already loaded."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterable
from typing import Generic, TypeVar

Job = TypeVar("Job")


class WarmQueue(Generic[Job]):
    """Jobs by room. Within a room they keep their order.

    Args:
        jobs: the jobs.
        room: of a job.
    """

    def __init__(self, jobs: Iterable[Job], room: Callable[[Job], Hashable]) -> None:
        self._room = room
        self._rooms: dict[Hashable, deque[Job]] = {}
        self._first: deque[Job] = deque()
        self._length = 0
        for job in jobs:
            self._rooms.setdefault(room(job), deque()).append(job)
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
        self, most: int, room: Hashable, others: Iterable[Hashable] = ()
    ) -> tuple[Hashable, list[Job]]:
        """Take up to ``most`` jobs of one room; one job, if it was put first.

        Args:
            most: from 1.
            room: the room that the worker has loaded; preferred.
            others: rooms that other workers have loaded; avoided while there are more rooms.

        Raises:
            IndexError: the queue is empty.
        """
        if self._first:
            self._length -= 1
            job = self._first.popleft()
            return self._room(job), [job]
        if room not in self._rooms:
            room = self._next_room(frozenset(others))
        jobs = self._rooms[room]
        taken = [jobs.popleft() for _ in range(min(most, len(jobs)))]
        if not jobs:
            del self._rooms[room]
        self._length -= len(taken)
        return room, taken

    def _next_room(self, others: frozenset[Hashable]) -> Hashable:
        """The first room that nobody has warm; else the one with the most jobs."""
        if not self._rooms:
            raise IndexError("there are no more jobs")
        free = next((room for room in self._rooms if room not in others), None)
        if free is not None:
            return free
        return max(self._rooms, key=lambda each: len(self._rooms[each]))
