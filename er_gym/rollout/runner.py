"""Play (agent x tasks) into a run directory; running again continues.

How episodes are executed is a row of :data:`EXECUTORS`: in worker processes, for agents that
compute, or in threads, for agents that mostly wait for a model's reply.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace

from er_gym.rollout.agent import CannotGoOn, MakeAgent
from er_gym.rollout.causes import causes_in
from er_gym.rollout.events import (
    Cost,
    EpisodeEnded,
    EventListener,
    EventLog,
    RunBegun,
    RunEnded,
    read_events,
)
from er_gym.rollout.executor import Assignment, Executor, Parallelism, PlayedEpisode
from er_gym.rollout.process_executor import play_in_processes
from er_gym.rollout.records import EpisodeRecord, episode_key
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.thread_executor import play_in_threads
from er_gym.tasks.task import Task

EXECUTORS: dict[str, Executor] = {
    "processes": play_in_processes,
    "threads": play_in_threads,
}
"""How episodes are executed, by name."""


@dataclass(frozen=True)
class RunSummary:
    """What :func:`run` did.

    Attributes:
        played: the number of episodes played.
        already_done: the number of episodes that were finished before it started.
        crashed: those of the played episodes that crashed or whose worker died three times. They
            are in the run directory and count as failures. The next run plays them again.
    """

    played: int
    already_done: int
    crashed: tuple[EpisodeRecord, ...]


class Stopped(CannotGoOn):
    """The run has stopped because an agent could not go on; ``summary`` says what was played."""

    def __init__(self, message: str, summary: RunSummary) -> None:
        super().__init__(message)
        self.summary = summary


def episodes_of(tasks: Iterable[Task], samples: int = 1) -> dict[str, tuple[Task, int]]:
    """The episodes of some tasks, each task played ``samples`` times in a row.

    Returns:
        The key of each episode (:func:`.records.episode_key`) to its task and the number of its
        sample, from 1.

    Raises:
        ValueError: two episodes would have the same key, since a task's id looks like one.
    """
    if samples < 1:
        raise ValueError(f"samples is {samples}; give a whole number from 1")
    found: dict[str, tuple[Task, int]] = {}
    for task in tasks:
        for sample in range(1, samples + 1):
            key = episode_key(task.id, sample)
            if key in found and samples > 1:
                raise ValueError(f"two episodes would be named {key!r:.80}; rename that task")
            found[key] = (task, sample)
    return found


def finished(
    directory: RunDirectory, tasks: Iterable[Task], samples: int = 1
) -> list[EpisodeRecord]:
    """The recorded episodes of these tasks that did not crash; they are not played again."""
    return [*_finished(directory, episodes_of(tasks, samples))]


def _finished(directory: RunDirectory, wanted: Container[str]) -> Iterator[EpisodeRecord]:
    """The same, one at a time, of the episodes with these keys."""
    return (each for each in directory.episodes() if each.key in wanted and not each.error)


def append_missing_events(directory: RunDirectory) -> None:
    """Append the events that are missing in the stream for results in the records.

    A process that was killed after writing a record and before its event leaves such a result.
    Without this, programs that follow the stream would never get the event.
    """
    told = {
        event.task_id: (event.success, event.error)
        for event in read_events(directory.path, ["episode_ended"])
        if isinstance(event, EpisodeEnded)
    }
    late = [
        _ended(each.key, each)
        for each in directory.episodes()
        if told.get(each.key) != (each.success, each.error)
    ]
    if late:
        with closing(EventLog(directory.path)) as log:
            log.append(late)


def _ended(key: str, record: EpisodeRecord) -> EpisodeEnded:
    return EpisodeEnded(
        task_id=key,
        task_type=record.task_type,
        success=record.success,
        end_reason=record.end_reason,
        total_reward=record.total_reward,
        steps=sum(not step.appended for step in record.steps[1:]),
        seconds=record.seconds,
        error=record.error,
        side_effects=None if record.side_effects is None else len(record.side_effects),
        **vars(causes_in(record)),
    )


def run(
    directory: RunDirectory,
    tasks: Sequence[Task],
    make_agent: MakeAgent,
    *,
    executor: str = "processes",
    parallelism: Parallelism = Parallelism(),  # noqa: B008 (frozen)
    listeners: Iterable[EventListener] = (),
    cost: Callable[[], Cost | None] = lambda: None,
    samples: int = 1,
    seeds: Mapping[str, int] | None = None,
) -> RunSummary:
    """Play the tasks without a finished episode in the run directory.

    Each episode is written before the next result is looked at. A run that is interrupted or killed
    thus loses no more than the episodes under way. If a worker process dies, its episode is played
    again with a new agent. After the third death the episode is recorded as crashed.

    Args:
        directory: the run directory. Its manifest states the environment, the seed, and how records
            name the agent.
        tasks: what to play.
        make_agent: makes the agent of an episode from the episode's task and seed. For
            ``"processes"`` it must be picklable.
        executor: a name in :data:`EXECUTORS`.
        parallelism: how much runs at once.
        listeners: called in this thread with the events of the run and of each episode that ends.
            Steps and replies are in the run directory's event stream
            (:func:`er_gym.rollout.events.read_events`).
        cost: returns what the run has cost so far; called after each episode.
        samples: how often each task is played. The samples of a task differ in their seeds; the
            first has the seed of a task that is played once.
        seeds: the seeds of episodes by key, where they do not follow from the run's.

    Raises:
        Stopped: an agent raised :class:`~er_gym.rollout.agent.CannotGoOn`.
        WorkerSetupError: the environment cannot be made.
        KeyboardInterrupt: Ctrl-C. The episodes that were over are saved, and no process is left.
        ValueError: there is no such executor, or it cannot use ``make_agent``.
        OSError: the run directory cannot be written.
    """
    if executor not in EXECUTORS:
        raise ValueError(f"unknown executor {executor!r}; choose one of: {', '.join(EXECUTORS)}")
    wanted = episodes_of(tasks, samples)
    append_missing_events(directory)
    done = {episode.key for episode in _finished(directory, wanted)}
    # An episode goes through the executors as a task of its own, whose id is the episode's key.
    todo = [
        task if sample == 1 else replace(task, id=key)
        for key, (task, sample) in wanted.items()
        if key not in done
    ]
    manifest = directory.manifest
    with closing(EventLog(directory.path, listeners)) as emit:
        emit(
            RunBegun(suite=manifest.suite, agent=manifest.agent, tasks=len(wanted), done=len(done))
        )
        sink = _Sink(directory, emit, cost, wanted)
        stopped = ""
        try:
            if todo:
                assigned = Assignment(directory, todo, make_agent, sink, parallelism, seeds or {})
                EXECUTORS[executor](assigned)
        except CannotGoOn as stop:
            stopped = str(stop)
            raise Stopped(stopped, sink.summary(len(done))) from stop
        except BaseException as error:  # Ctrl-C too
            stopped = f"{type(error).__name__}: {error}"
            raise
        finally:
            emit(RunEnded(played=sink.played, crashed=len(sink.crashed), stopped=stopped))
    return sink.summary(len(done))


@dataclass
class _Sink:
    """Writes episodes into the run directory, and emits their events."""

    directory: RunDirectory
    emit: EventLog
    cost: Callable[[], Cost | None]
    wanted: Mapping[str, tuple[Task, int]]
    played: int = 0
    crashed: list[EpisodeRecord] = field(default_factory=list)

    def save(self, played: PlayedEpisode) -> None:
        self.directory.attach(played.record.task_id, played.attachments, played.folders)
        task, sample = self.wanted[played.record.task_id]
        stated = {"task_id": task.id, "sample": sample}
        self.directory.write(played.record.model_copy(update=stated))

    def ended(self, played: PlayedEpisode) -> None:
        record = played.record
        self.played += 1
        if record.error:
            self.crashed.append(record)
        self.emit(_ended(record.task_id, record))
        total = self.cost()
        if total is not None:
            self.emit(total)

    def summary(self, already_done: int) -> RunSummary:
        return RunSummary(self.played, already_done, tuple(self.crashed))
