"""Does jobs in a group of Ray actors, also if actors and their nodes die.

The driver holds all jobs and gives each actor a few at a time, so that neither a queue nor results
pile up anywhere. If an actor is lost, so are the results of its present jobs. If its node was lost,
too, other actors do these jobs, and no job is blamed. If the actor died alone, a job may have
killed it: each of its jobs is tried again alone, and a job whose worker dies three times is given
up, as :func:`er_gym.rollout.worker_pool.run_jobs` does.
"""

from __future__ import annotations

import pickle
import time
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import ray
from ray import cloudpickle
from ray.exceptions import ActorUnavailableError, RayError, RayTaskError

from er_gym.rollout.cluster.actors import Begun, Done, JobActor, start_actor
from er_gym.rollout.cluster.origin import Origin
from er_gym.rollout.cluster.warm_queue import WarmQueue
from er_gym.rollout.worker_pool import LostJob, WorkerSetupError

Job = TypeVar("Job")
Result = TypeVar("Result")

_BATCH_SECONDS = 0.1
"""Short jobs are sent together, about so many seconds of them."""
_MOST_AT_ONCE = 64
_SHORT_SECONDS = 1.0
"""An actor with jobs shorter than this has the next batch before it has done the last."""
_MOST_DEATHS = 20
"""After so many deaths in a row, with no job done between them, nothing is tried any more."""
_FIRST_WAIT, _LONGEST_WAIT = 0.5, 30.0
_TELL_SECONDS = 15.0
_LOOK_SECONDS = 5.0
_MOST_LOSSES = 10
"""A job is given up when so many of its workers were lost without fault of its own."""


@dataclass(eq=False)
class _Try(Generic[Job]):
    """A job on its way.

    Attributes:
        number: of this try, from 1.
        lost: how often its worker was lost with its node.
    """

    job: Job
    number: int = 1
    lost: int = 0

    @property
    def again(self) -> bool:
        return self.number > 1 or self.lost > 0


@dataclass(eq=False)
class _Member(Generic[Job]):
    """An actor.

    Attributes:
        beginning: until it is ready, the reference of :class:`.Begun`.
        batches: what it has been given, in order: the reference of :class:`.Done`, and the jobs.
        affinity: the affinity key of its last job.
        retiring: whether it gets no more.
    """

    actor: Any
    beginning: Any
    batches: deque[tuple[Any, list[_Try[Job]]]] = field(default_factory=deque)
    affinity: Hashable = None
    retiring: bool = False

    @property
    def next_ref(self) -> Any:
        """What it will answer next; None if it was asked nothing."""
        return self.beginning or (self.batches[0][0] if self.batches else None)


@dataclass(frozen=True)
class ActorOptions:
    """The resources and limits with which actors are started.

    Attributes:
        ray_options: of ``ActorClass.options``.
        memory: a worker with more resident memory is replaced, bytes.
        path: folders that actors add to their ``sys.path``.
        say: called with a message for the user while the cluster has no resources for an actor.
    """

    ray_options: dict[str, Any]
    memory: int
    path: Sequence[str]
    say: Callable[[str], None]


class ActorPool(Generic[Job, Result]):
    """Does jobs; see the module.

    Args:
        options: of its actors.
        make: as :func:`er_gym.rollout.worker_pool.run_jobs` takes it.
        jobs: as there.
        workers: the largest number of actors.
        tries: as there.
        affinity_key: of a job, as there.
    """

    def __init__(
        self,
        options: ActorOptions,
        make: Callable[[], Callable[[Job], Result]],
        jobs: Iterable[Job],
        *,
        workers: int,
        tries: int,
        affinity_key: Callable[[Job], Hashable],
    ) -> None:
        self._options, self._workers, self._tries = options, workers, tries
        pickled: bytes = cloudpickle.dumps(make)  # type: ignore[no-untyped-call]
        self._make = ray.put(pickled)
        self._queue = WarmQueue(
            (_Try(job) for job in jobs), lambda attempt: affinity_key(attempt.job)
        )
        self._members: list[_Member[Job]] = []
        self._job_seconds = 0.0
        self._deaths = 0
        self._told_of_memory = False
        self._start_after = self._told = time.monotonic()

    def results(self) -> Generator[tuple[Job, Result | LostJob], None, None]:
        """Each job with its result, as :func:`er_gym.rollout.worker_pool.run_jobs` yields them."""
        try:
            while self._queue or any(member.batches for member in self._members):
                self._start_actors()
                for member in self._members:
                    self._give(member)
                yield from self._news()
        finally:
            for member in self._members:
                self._dismiss(member)

    # -- actors ----------------------------------------------------------------------------------

    def _start_actors(self) -> None:
        """Start actors, as many as there are jobs for."""
        at_work = sum(len(batch) for member in self._members for _, batch in member.batches)
        wanted = min(self._workers, len(self._queue) + at_work)
        while len(self._members) < wanted and time.monotonic() >= self._start_after:
            actor = start_actor(JobActor, self._options.ray_options)
            beginning = actor.begin.remote(Origin.here(), self._options.path, self._make)
            self._members.append(_Member(actor, beginning))

    def _dismiss(self, member: _Member[Job]) -> None:
        ray.kill(member.actor, no_restart=True)

    def _give(self, member: _Member[Job]) -> None:
        """Give an actor as many batches as it may have at once."""
        while (
            self._queue
            and member.beginning is None
            and not member.retiring
            and len(member.batches) < self._depth(member)
        ):
            others = [one.affinity for one in self._members if one is not member]
            member.affinity, batch = self._queue.take(self._batch_size(), member.affinity, others)
            jobs = pickle.dumps([attempt.job for attempt in batch])
            member.batches.append((member.actor.do.remote(jobs), batch))

    def _depth(self, member: _Member[Job]) -> int:
        """How many batches an actor may have at once.

        A job that is tried again is all that its actor has, so that no other is lost with it.
        """
        tried_before = any(attempt.again for _, batch in member.batches for attempt in batch)
        short = self._job_seconds < _SHORT_SECONDS
        return 2 if short and not self._queue.has_first and not tried_before else 1

    def _batch_size(self) -> int:
        """So many jobs that they take a tenth of a second; fewer towards the end, so that all
        actors have work until then."""
        if not self._job_seconds:
            return 1
        share = len(self._queue) // (2 * len(self._members))
        return max(1, min(int(_BATCH_SECONDS / self._job_seconds), _MOST_AT_ONCE, share))

    # -- what comes back -------------------------------------------------------------------------

    def _news(self) -> Generator[tuple[Job, Result | LostJob], None, None]:
        """Wait for the next answers and handle them."""
        asked = {member.next_ref: member for member in self._members if member.next_ref}
        if not asked:  # all died; wait until others may be started
            time.sleep(max(0.0, self._start_after - time.monotonic()))
            return
        ready, rest = ray.wait([*asked], timeout=_LOOK_SECONDS)
        if rest and ready:
            more, _ = ray.wait(rest, num_returns=len(rest), timeout=0)
            ready += more
        for ref in ready:
            member = asked[ref]
            try:
                answer = ray.get(ref)
            except RayError as error:
                yield from self._lost(member, error)
                continue
            if isinstance(answer, Begun):
                if answer.problem:
                    raise WorkerSetupError(answer.problem)
                member.beginning = None
            else:
                yield from self._done(member, answer)
        if not ready:
            self._tell_if_waiting()

    def _done(self, member: _Member[Job], done: Done) -> Generator[tuple[Job, Result], None, None]:
        _, batch = member.batches.popleft()
        each = done.seconds / len(batch)
        self._job_seconds = each if not self._job_seconds else 0.8 * self._job_seconds + 0.2 * each
        self._deaths = 0
        if done.memory > self._options.memory:
            member.retiring = True
            self._tell_of_memory(done.memory)
        if member.retiring and not member.batches:
            self._members.remove(member)
            self._dismiss(member)
        for attempt, result in zip(batch, done.results, strict=True):
            yield attempt.job, result

    def _lost(
        self, member: _Member[Job], error: RayError
    ) -> Generator[tuple[Job, LostJob], None, None]:
        """An actor is gone; the jobs that it had are done again."""
        if getattr(error, "actor_init_failed", False):
            raise WorkerSetupError(first_line(error)) from None
        self._members.remove(member)
        self._dismiss(member)
        self._wait_after_death(error)
        for place, (_, batch) in enumerate(member.batches):
            # The second batch had not begun: none of it is to blame.
            suspects = place == 0 and not is_nodes_fault(error)
            for attempt in batch:
                alone = len(batch) == 1
                attempt.number += suspects and alone
                attempt.lost += not suspects
                if attempt.number > self._tries or attempt.lost > _MOST_LOSSES:
                    tries = attempt.number + attempt.lost - 1
                    yield attempt.job, LostJob(tries, None, first_line(error))
                else:
                    self._queue.put_first(attempt)

    def _wait_after_death(self, error: RayError) -> None:
        """Start actors again at once after one death, later and later after several in a row."""
        self._deaths += 1
        if self._deaths > _MOST_DEATHS:
            raise WorkerSetupError(
                f"{self._deaths} workers died one after another, the last: {first_line(error)}"
            )
        if self._deaths > len(self._members) + 1:
            wait = min(_LONGEST_WAIT, _FIRST_WAIT * 2 ** (self._deaths - 2))
            self._start_after = time.monotonic() + wait

    def _tell_of_memory(self, memory: int) -> None:
        """Say once that workers grow larger than they are allowed to."""
        if not self._told_of_memory:
            self._told_of_memory = True
            self._options.say(
                f"a worker takes {memory / 2**30:.1f} GiB, more than the "
                f"{self._options.memory / 2**30:.1f} GiB that it has asked for, and is replaced; "
                "if that happens often, give a larger --worker-memory"
            )

    def _tell_if_waiting(self) -> None:
        """Say so if the cluster has had no place for a single actor for long."""
        waiting = self._members and all(member.beginning for member in self._members)
        if waiting and time.monotonic() - self._told > _TELL_SECONDS:
            self._told = time.monotonic()
            self._options.say(waiting_message(len(self._members), self._options.ray_options))


def is_nodes_fault(error: RayError) -> bool:
    """Whether an actor was lost with its node, or with the connection to it."""
    return isinstance(error, ActorUnavailableError) or "node has died" in str(error)


def first_line(error: BaseException) -> str:
    """The reason that Ray gives for an error, in one short line."""
    if isinstance(error, RayTaskError):  # the job raised it
        return " ".join(f"{type(error.cause).__name__}: {error.cause}".split())[:300]
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    why = next((line for line in reversed(lines) if line.startswith("The actor")), lines[0])
    return why.partition(". ")[0].rstrip(".")


def waiting_message(wanted: int, options: dict[str, Any]) -> str:
    """The message while no worker has started: it says whether the cluster lacks resources."""
    free: dict[str, float] = ray.available_resources()  # type: ignore[no-untyped-call]
    cpus, memory = free.get("CPU", 0), free.get("memory", 0)
    asks = f"{options['num_cpus']:g} CPU and {options['memory'] / 2**30:.1f} GiB"
    if cpus >= options["num_cpus"] and memory >= options["memory"]:
        return f"waiting for {wanted} workers to start, with {asks} each"
    return (
        f"waiting for a place on the cluster: {wanted} workers want {asks} each, all nodes "
        f"together have {cpus:g} CPU and {memory / 2**30:.1f} GiB free"
    )
