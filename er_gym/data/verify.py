"""Verifies a collection: every trajectory is replayed, its course and its thoughts are checked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby, islice
from pathlib import Path
from typing import Any

from er_gym.data import critic
from er_gym.data.collection import TRAJECTORIES, Collection, CollectionError
from er_gym.data.comparing import compared
from er_gym.data.copies import check_manifests, copy_problems
from er_gym.data.course_checks import course_problems
from er_gym.data.header_checks import Origin, header_problems
from er_gym.data.knowledge import knowledge_at
from er_gym.data.line_index import Line, lines_of, trajectory_at
from er_gym.data.pictures import Encoding
from er_gym.data.reenactment import NOBODY, Reenact
from er_gym.data.replay import replay
from er_gym.data.shown_pictures import Album
from er_gym.data.train_rule import own_voice, repeats_own_words
from er_gym.data.trajectory import Trajectory
from er_gym.data.turn_checks import turn_problems
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import error_with_location
from er_gym.rollout.processes import Terminated
from er_gym.rollout.worker_backend import LOCAL_BACKEND, WorkerBackend
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.resolve import resolve_tasks
from er_gym.tasks.task import Task

MOST_WORDS = 200
"""The longest thought that the paper asks for, in words."""
_AT_ONCE = 16
"""Trajectories of one room that a worker is given at once."""


@dataclass(frozen=True)
class Verdict:
    """What was found about one trajectory.

    Attributes:
        id: the trajectory's.
        problems: in a line each; empty if all is equal and right.
        turns, pictures, thoughts: how many were compared or checked.
        anew: how many of the thoughts were written anew and compared, too; the others are only
            checked by the critic.
        sentences, unread: how many sentences the thoughts have, and in how many of them the
            critic's rules read no claim.
    """

    id: str
    problems: tuple[str, ...]
    turns: int = 0
    pictures: int = 0
    thoughts: int = 0
    anew: int = 0
    sentences: int = 0
    unread: int = 0


@dataclass
class Totals:
    """Sums of verdicts.

    Attributes:
        trajectories, turns, pictures, thoughts, anew, sentences, unread: how many there were, as
            verdicts have them.
        wrong: how many trajectories have problems.
    """

    trajectories: int = 0
    turns: int = 0
    pictures: int = 0
    thoughts: int = 0
    anew: int = 0
    sentences: int = 0
    unread: int = 0
    wrong: int = 0

    def add(self, verdict: Verdict) -> None:
        """Count a verdict."""
        self.trajectories += 1
        self.turns += verdict.turns
        self.pictures += verdict.pictures
        self.thoughts += verdict.thoughts
        self.anew += verdict.anew
        self.sentences += verdict.sentences
        self.unread += verdict.unread
        self.wrong += bool(verdict.problems)


@dataclass(frozen=True)
class _Batch:
    """Trajectories of one part and room, and the tasks of those that have one."""

    part: str
    lines: tuple[Line, ...]
    tasks: Mapping[str, Task] = field(default_factory=dict)


def verify(
    collection: Collection,
    tasks: Iterable[Task],
    *,
    pictures: bool = True,
    limit: int | None = None,
    workers: int = 1,
    worker_backend: WorkerBackend = LOCAL_BACKEND,
    reenact: Reenact = NOBODY,
) -> Generator[Verdict, None, None]:
    """Verify the trajectories of a collection; the verdicts come in no particular order.

    Args:
        collection: the collection.
        tasks: the suite's.
        pictures: whether pictures are compared; without them it is several times as fast.
        limit: verify only the first so many.
        workers: how many processes, at least 1.
        worker_backend: where they run; they must see the collection's files.
        reenact: knows how the collection's agents decide.

    Raises:
        CollectionError: the collection is damaged, or a part's manifest is not that of the
            collection.
        WorkerSetupError: the environment cannot be made.
    """
    lines = list(islice(lines_of(collection), limit))
    check_manifests(collection)  # a damaged part is told before anything is played
    twice = [name for name, count in Counter(line.id for line in lines).items() if count > 1]
    if twice:
        raise CollectionError(
            f"{collection.path / TRAJECTORIES}: the trajectory {twice[0]!r:.300} is there "
            "twice; the er-gym collect that made the collection writes the file anew"
        )
    batches = _batches(lines, tasks)
    make = partial(_Worker, collection.path.absolute(), pictures, reenact)
    with closing(
        worker_backend.run_jobs(make, batches, workers=workers, affinity_key=_room)
    ) as results:
        for batch, verdicts in results:
            if isinstance(verdicts, LostJob):
                yield from (Verdict(line.id, (str(verdicts),)) for line in batch.lines)
            else:
                yield from verdicts


def thought_problems(
    trajectory: Trajectory,
    limits: Mapping[str, int] | None = None,
    read: Counter[str] | None = None,
) -> Iterator[str]:
    """The critic's objections to a trajectory's thoughts, one line each.

    If a model decided and thought in one reply, or failed where a correction begins, its thoughts
    are kept as they are, and the record has the critic's objections. Then it is a problem only if
    these are others.

    Args:
        trajectory: the trajectory.
        limits: the most words of a model's own thought of each kind; None if nothing tells them.
            Then the record may have objections that the critic does not have now.
        read: counts the ``sentences``, and those ``unread``, in which the rules read no claim.
    """
    counts: Counter[str] = Counter() if read is None else read
    for index, turn in enumerate(trajectory.turns):
        if not turn.thoughts:
            continue
        knowledge = knowledge_at(
            trajectory.turns,
            index,
            instruction=trajectory.instruction,
            language=trajectory.language,
        )
        voice = own_voice(trajectory, index)
        for number, thought in enumerate(turn.thoughts):
            quoted = bool(voice) and thought.writer == voice
            limit = limits[thought.kind] if quoted and limits else MOST_WORDS
            reviewed = critic.review(thought.text, thought.kind, knowledge, limit=limit)
            found = reviewed.refusals
            counts["sentences"] += reviewed.true + reviewed.false + reviewed.unknown
            counts["unread"] += reviewed.unknown
            if quoted and limits:
                codes = [*dict.fromkeys(each.code for each in found)]
                for line in compared("refused", thought.refused, codes, "the critic"):
                    yield f"turn {index}: thoughts[{number}].{line}"
                continue
            for refusal in found:
                if not (quoted and refusal.code in thought.refused):
                    yield f"turn {index}: {thought.kind}: {refusal.code}: {refusal.detail}"


def _written_anew(trajectory: Trajectory) -> int:
    """How many thoughts a reenactment writes anew: all but what a failed agent itself thought."""
    return sum(
        len(turn.thoughts)
        for index, turn in enumerate(trajectory.turns)
        if not repeats_own_words(trajectory, index)
    )


def _batches(lines: Sequence[Line], tasks: Iterable[Task]) -> list[_Batch]:
    """The work, in portions that keep a worker's room warm."""
    wanted = {line.task_id for line in lines}
    fitted = resolve_tasks(task for task in tasks if task.id in wanted)
    by_id = {task.id: task for task in fitted.tasks}
    ordered = sorted(lines, key=lambda line: (line.part, line.scene, line.task_id, line.offset))
    batches = []
    for (part, _), group in groupby(ordered, key=lambda line: (line.part, line.scene)):
        rest = list(group)
        for first in range(0, len(rest), _AT_ONCE):
            some = tuple(rest[first : first + _AT_ONCE])
            its_tasks = {
                line.task_id: by_id[line.task_id] for line in some if line.task_id in by_id
            }
            batches.append(_Batch(part, some, its_tasks))
    return batches


def _room(batch: _Batch) -> str:
    return batch.lines[0].scene


class _Worker:
    """Verifies batches, in one environment for the part at hand."""

    def __init__(self, path: Path, pictures: bool, reenact: Reenact) -> None:
        self._collection = Collection.open(path)
        self._parts = self._collection.parts()
        self._folder = path if pictures else None
        self._reenact = reenact
        self._critic_works = True
        self._part = ""
        self._env: EmbodiedEnv | None = None

    def __call__(self, batch: _Batch) -> list[Verdict]:
        return [
            self._verdict(line, batch.tasks.get(line.task_id), batch.part) for line in batch.lines
        ]

    def _verdict(self, line: Line, task: Task | None, part: str) -> Verdict:
        try:
            trajectory = trajectory_at(self._collection, line.offset)
        except CollectionError as error:
            return Verdict(line.id, (str(error),))
        problems = [*course_problems(trajectory), *turn_problems(trajectory)]
        if task is None:
            problems.append(f"the suite has no task {line.task_id!r:.80} that can be played")
        elif part not in self._parts:
            problems.append(f"the collection has no part {part!r:.80}")
        else:
            problems += self._caught(lambda: self._derived(task, trajectory, part))
        read: Counter[str] = Counter()
        problems += self._thoughts_checked(trajectory, read)
        thoughts = sum(len(turn.thoughts) for turn in trajectory.turns)
        anew = self._reenact.writes(self._collection.manifest, trajectory)
        return Verdict(
            line.id,
            tuple(dict.fromkeys(problems)),
            turns=trajectory.actions,
            pictures=trajectory.pictures if self._folder else 0,
            thoughts=thoughts if self._critic_works else 0,
            anew=_written_anew(trajectory) if anew else 0,
            sentences=read["sentences"],
            unread=read["unread"],
        )

    def _derived(self, task: Task, trajectory: Trajectory, part: str) -> Iterator[str]:
        """What differs from the task, the settings, the part's own record and the replay."""
        manifest = self._collection.manifest
        yield from header_problems(Origin(task, manifest), trajectory)
        yield from copy_problems(self._collection, trajectory)
        played = self._reenact(manifest, task, trajectory)
        for name, now in played.header.items() if played else ():
            yield from compared(name, getattr(trajectory, name), now, "the seed and the settings")
        recorded = "rgb" in self._parts[part].manifest.env["obs_mode"]
        album = Album(recorded, self._folder if recorded else None, _encoding(manifest.settings))
        yield from replay(self._of(part), task, trajectory, album, played)

    def _thoughts_checked(self, trajectory: Trajectory, read: Counter[str]) -> list[str]:
        if not self._critic_works:
            return []
        try:
            limits = self._collection.manifest.settings.get("thoughts", {}).get("limits", {})
            return self._caught(lambda: thought_problems(trajectory, limits.get("alone"), read))
        except NotImplementedError:
            self._critic_works = False
            return []

    def _caught(self, check: Callable[[], Iterable[str]]) -> list[str]:
        """The problems that a check finds; an exception is one."""
        try:
            return list(check())
        except (Terminated, NotImplementedError):
            raise
        except Exception as error:  # damaged records may raise anything
            self.close()
            return [error_with_location(error)]

    def _of(self, part: str) -> EmbodiedEnv:
        """The environment of a part; that of the part before is closed."""
        if self._env is None or self._part != part:
            self.close()
            env = dict(self._parts[part].manifest.env)
            pictured = self._folder and "rgb" in env["obs_mode"]
            env["obs_mode"] = "rgb+objects" if pictured else "objects"
            self._part, self._env = part, EmbodiedEnv((), **env)
        return self._env

    def close(self) -> None:
        """Close the environment."""
        env, self._env = self._env, None
        if env is not None:
            env.close()


def _encoding(settings: Mapping[str, Any]) -> Encoding | None:
    """How a collection's pictures are written, as its settings say."""
    told = settings.get("pictures")
    return Encoding(told["format"], told["quality"]) if told else None
