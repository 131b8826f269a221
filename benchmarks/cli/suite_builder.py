"""Make a suite: rooms rearranged, tasks generated, each one verified, a balanced choice taken.

Each room is made by itself, from the suite's seed and its own name, so that the suite is the same
whatever the number of workers. What a room gives is kept in a file until the suite is whole: a run
that is interrupted or killed goes on from there.
"""

from __future__ import annotations

import hashlib
import json
import random
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice
from pathlib import Path

from er_gym import __version__
from er_gym.envs.verify import rejection_reason, with_difficulty
from er_gym.rollout.verification import make_verifier
from er_gym.rollout.worker_pool import LostJob, run_jobs
from er_gym.tasks import jsonl_format
from er_gym.tasks.arrangement import Start
from er_gym.tasks.generate import Generator, arranged, select_balanced
from er_gym.tasks.suite_spec import Making
from er_gym.tasks.task import Task
from er_gym.tasks.types import TASK_TYPES
from er_gym.thor import make_controller
from er_gym.writing import make_folder

_TRIES = 3
"""How many tasks of a type and arrangement are played for each that is wanted."""


@dataclass(frozen=True)
class Made:
    """What came of some rooms.

    Attributes:
        tasks: verified.
        dropped: how many were not taken, by why.
    """

    tasks: tuple[Task, ...] = ()
    dropped: Counter[str] = field(default_factory=Counter)

    def and_also(self, other: Made) -> Made:
        """Both together."""
        return Made((*self.tasks, *other.tasks), self.dropped + other.dropped)


class Maker:
    """Makes the tasks of one room after another."""

    def __init__(self, making: Making, seed: int) -> None:
        self._making, self._seed = making, seed
        self._controller = make_controller(headless=True)
        self._verify = make_verifier()

    def __call__(self, scene: str) -> Made:
        """The tasks of a room, in all its arrangements."""
        rng = random.Random(f"{self._seed}/{scene}")
        # Drawn too, so that two suites do not share arrangements; 0 is the recorded one.
        layouts = [0, *rng.sample(range(1, 10**6), self._making.layouts)]
        made = Made()
        for layout in layouts:
            made = made.and_also(self._of(arranged(self._controller, scene, layout), rng))
        return made

    def _of(self, room: Generator, rng: random.Random) -> Made:
        """The tasks of a room as it is arranged."""
        kept: list[Task] = []
        for kind in TASK_TYPES:
            if not self._making.types or kind.name in self._making.types:
                candidates = list(room.tasks([kind.name]))
                rng.shuffle(candidates)
                kept += islice(self._verified(candidates, room), self._making.per_layout)
        return Made(tuple(kept), room.dropped)

    def _verified(self, candidates: Iterable[Task], room: Generator) -> Iterator[Task]:
        """The tasks that are wanted and can be done; not too many are played."""
        tries = self._making.per_layout * _TRIES
        for task in candidates:
            problem = rejection_reason(task, room, self._making, self._verify)
            if not problem:
                if not tries:
                    return
                tries -= 1
                verdict = self._verify(task)
                problem = verdict.problem
                if not problem:
                    yield with_difficulty(task, room, verdict)
                    continue
            room.dropped[problem] += 1

    def close(self) -> None:
        """Stop the engines."""
        self._controller.stop()
        self._verify.close()


def make_suite(
    making: Making,
    seed: int,
    *,
    parts: Path,
    workers: int = 1,
    on_room: Callable[[str, Made], None] = lambda scene, made: None,
) -> Made:
    """Make a suite's tasks; the same for the same making and seed.

    Args:
        parts: a folder for what rooms give, which need not be there; what is there is used.
        workers: how many processes.
        on_room: called with each room and what it gave.

    Raises:
        RuntimeError: a room's worker died again and again.
    """
    make_folder(parts)
    done = {scene: part for scene in making.rooms if (part := _read(_file(parts, scene)))}
    for scene, part in done.items():
        on_room(scene, part)
    todo = [scene for scene in making.rooms if scene not in done]
    with closing(run_jobs(partial(Maker, making, seed), todo, workers=workers)) as results:
        for scene, made in results:
            if isinstance(made, LostJob):
                raise RuntimeError(
                    f"the worker that made {scene} died {made.tries} times, last with exit code "
                    f"{made.exitcode}"
                )
            _write(_file(parts, scene), made)
            done[scene] = made
            on_room(scene, made)
    every = Made()
    for scene in making.rooms:
        every = every.and_also(done[scene])
    chosen = select_balanced(every.tasks, making.total, random.Random(seed))
    return Made(tuple(_layouts_together(chosen)), every.dropped)


def parts_of(out: Path, making: Making, seed: int) -> Path:
    """Where the parts of a suite are kept until it is whole: beside it, for this making alone."""
    told = json.dumps([making.model_dump(mode="json"), seed, __version__])
    return out.with_name(f".{out.name}.parts-{hashlib.sha256(told.encode()).hexdigest()[:8]}")


def remove_parts(parts: Path) -> None:
    """The suite is whole."""
    shutil.rmtree(parts, ignore_errors=True)


def _layouts_together(tasks: Sequence[Task]) -> Iterable[Task]:
    """The same tasks; arrangements that are equal become one object, which is written once."""
    starts: dict[str, Start] = {}
    for task in tasks:
        start = starts.setdefault(task.start.layout, task.start)
        yield replace(task, start=replace(task.start, poses=start.poses))


def _file(parts: Path, scene: str) -> Path:
    return parts / f"{scene}.jsonl"


def _write(path: Path, made: Made) -> None:
    jsonl_format.write_tasks(path, made.tasks, dropped=dict(made.dropped))


def _read(path: Path) -> Made | None:
    """What a room gave; None where that is not known, or its file is damaged."""
    try:
        header = json.loads(path.read_text(encoding="utf-8").partition("\n")[0])
        return Made(tuple(jsonl_format.read_tasks(path)), Counter(header["dropped"]))
    except (OSError, ValueError, TypeError, KeyError):
        return None
