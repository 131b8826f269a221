"""Build a suite: rearrange rooms, generate tasks, verify each one, choose a balanced set.

Each room is built on its own, from the suite's seed and the room's name, so the suite does not
depend on the number of workers. The tasks of a room go to a file until the suite is complete. A run
that was interrupted or killed continues from these files.
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
from er_gym.rollout.worker_backend import LOCAL_BACKEND, WorkerBackend
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks import jsonl_format
from er_gym.tasks.arrangement import Arrangement
from er_gym.tasks.generate import Generator, generator_for, select_balanced
from er_gym.tasks.suite_spec import SuiteSpec
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME
from er_gym.tasks.wordings.instructions import half_unseen, in_language
from er_gym.thor import make_controller
from er_gym.writing import make_folder

_TRIES = 3
"""How many tasks of a type and arrangement are played at most, for each task to build."""


@dataclass(frozen=True)
class BuildResult:
    """The tasks of some rooms.

    Attributes:
        tasks: the verified ones.
        dropped: reason to how many tasks were dropped for it.
    """

    tasks: tuple[Task, ...] = ()
    dropped: Counter[str] = field(default_factory=Counter)

    def plus(self, other: BuildResult) -> BuildResult:
        """The sum of both."""
        return BuildResult((*self.tasks, *other.tasks), self.dropped + other.dropped)


class RoomBuilder:
    """Builds the tasks of one room after another."""

    def __init__(self, spec: SuiteSpec, seed: int) -> None:
        self._spec, self._seed = spec, seed
        self._controller = make_controller(headless=True)
        self._verify = make_verifier()

    def __call__(self, scene: str) -> BuildResult:
        """The tasks of a room, in all its arrangements."""
        rng = random.Random(f"{self._seed}/{scene}")
        # Drawn too, so that two suites do not share arrangements; 0 is the recorded one.
        layouts = [0] * self._spec.recorded + rng.sample(range(1, 10**6), self._spec.layouts)
        made = BuildResult()
        for layout in layouts:
            made = made.plus(self._of(generator_for(self._controller, scene, layout), rng))
        return made

    def _of(self, room: Generator, rng: random.Random) -> BuildResult:
        """The tasks of a room in its present arrangement."""
        kept: list[Task] = []
        for kind in BY_NAME.values():
            if not self._spec.types or kind.name in self._spec.types:
                candidates = list(room.tasks([kind.name]))
                rng.shuffle(candidates)
                kept += islice(self._verified(candidates, room), self._spec.per_layout)
        return BuildResult(tuple(kept), room.dropped)

    def _verified(self, candidates: Iterable[Task], room: Generator) -> Iterator[Task]:
        """The tasks that fit the spec and can be done; plays a limited number of them."""
        tries = self._spec.per_layout * _TRIES
        for task in candidates:
            problem = rejection_reason(task, room, self._spec, self._verify)
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


def build_suite(
    spec: SuiteSpec,
    seed: int,
    *,
    parts: Path,
    workers: int = 1,
    worker_backend: WorkerBackend = LOCAL_BACKEND,
    on_room: Callable[[str, BuildResult], None] = lambda scene, made: None,
) -> BuildResult:
    """Build the tasks of a suite; the same spec and seed give the same tasks.

    Args:
        parts: the folder of finished rooms; made if missing, used if it has some.
        workers: how many processes.
        worker_backend: where they run.
        on_room: called with each room and its tasks.

    Raises:
        RuntimeError: a room's worker died again and again.
    """
    make_folder(parts)
    done = {scene: part for scene in spec.rooms if (part := _read(_file(parts, scene)))}
    for scene, part in done.items():
        on_room(scene, part)
    todo = [scene for scene in spec.rooms if scene not in done]
    make = partial(RoomBuilder, spec, seed)
    with closing(worker_backend.run_jobs(make, todo, workers=workers)) as results:
        for scene, made in results:
            if isinstance(made, LostJob):
                raise RuntimeError(f"{scene}: {made}")
            _write(_file(parts, scene), made)
            done[scene] = made
            on_room(scene, made)
    every = BuildResult()
    for scene in spec.rooms:
        every = every.plus(done[scene])
    chosen = select_balanced(every.tasks, spec.total, random.Random(seed))
    kept = [task for task in chosen if task.scene not in spec.left_out]
    told = in_language(half_unseen(kept) if spec.unseen_wordings else kept, spec.language)
    return BuildResult(tuple(_layouts_together(told)), every.dropped)


def parts_folder(out: Path, spec: SuiteSpec, seed: int) -> Path:
    """The folder of a suite's unfinished parts: beside it, and for this spec alone."""
    told = json.dumps([spec.model_dump(mode="json"), seed, __version__])
    return out.with_name(f".{out.name}.parts-{hashlib.sha256(told.encode()).hexdigest()[:8]}")


def remove_parts(parts: Path) -> None:
    """Remove the parts of a complete suite."""
    shutil.rmtree(parts, ignore_errors=True)


def _layouts_together(tasks: Sequence[Task]) -> Iterable[Task]:
    """The same tasks; equal arrangements become one object, which is written once."""
    starts: dict[str, Arrangement] = {}
    for task in tasks:
        arrangement = starts.setdefault(task.arrangement.layout, task.arrangement)
        yield replace(task, arrangement=replace(task.arrangement, poses=arrangement.poses))


def _file(parts: Path, scene: str) -> Path:
    return parts / f"{scene}.jsonl"


def _write(path: Path, made: BuildResult) -> None:
    jsonl_format.write_tasks(path, made.tasks, dropped=dict(made.dropped))


def _read(path: Path) -> BuildResult | None:
    """A finished room's tasks; None where its file is missing or damaged."""
    try:
        header = json.loads(path.read_text(encoding="utf-8").partition("\n")[0])
        return BuildResult(tuple(jsonl_format.read_tasks(path)), Counter(header["dropped"]))
    except (OSError, ValueError, TypeError, KeyError):
        return None
