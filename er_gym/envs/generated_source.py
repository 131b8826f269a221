"""An endless source of tasks: it rearranges rooms, generates tasks and verifies each by playing."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

from er_gym.envs.arguments import short_repr
from er_gym.envs.verify import PlayableEnv, Verifier, rejection_reason, with_difficulty
from er_gym.houses.names import is_house
from er_gym.tasks.generate import Generator, generated_types, generator_for
from er_gym.tasks.suite_spec import SuiteSpec
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME, TaskType
from er_gym.thor import SCENE_NAMES, make_controller

TRAINING = SuiteSpec(total=1, scenes="training", layouts=1000, unseen_objects=False)
"""Tasks in the training rooms, without the object types kept for evaluation."""
_ROOMS = 40
"""The number of arranged rooms tried for one task."""
_CANDIDATES = 4
"""The number of tasks of one room that are played before the next room is tried."""
_KEPT = 32
"""The number of arranged rooms in the cache."""


class GeneratedSource:
    """Generates tasks on demand; it needs no files and never runs out.

    A draw takes a room, an arrangement of it and a task at random, and plays the task on an
    embedded engine of its own. Tasks that cannot be done are skipped. A draw depends only on the
    state of the random generator, not on earlier draws.

    Args:
        env: the environment in which tasks are verified; the source closes it.
        spec: the rooms, the task types, the number of arrangements of a room to draw from beside
            the recorded one, and the difficulty; its ``total`` and ``per_layout`` are ignored.
    """

    def __init__(self, env: PlayableEnv, spec: SuiteSpec = TRAINING) -> None:
        self._env, self._spec = env, spec
        self._kinds = [BY_NAME[name] for name in spec.types] or list(generated_types())
        self._controller = make_controller(headless=True)
        self._verify = Verifier(env)
        self._room: Callable[[str, int], Generator]
        self._room = lru_cache(_KEPT)(partial(generator_for, self._controller))

    def __reduce__(self) -> tuple[type[GeneratedSource], tuple[PlayableEnv, SuiteSpec]]:
        # A copy has engines of its own; what is drawn depends on the random generator alone.
        return GeneratedSource, (self._env, self._spec)

    def draw(self, rng: np.random.Generator, task_type: TaskType | None, scene: str | None) -> Task:
        """Draw a task that the solver has just solved."""
        house = bool(scene) and is_house(str(scene))
        if scene and scene not in SCENE_NAMES and not house:
            raise ValueError(
                f"unknown scene {short_repr(scene)}; give a name such as FloorPlan1 or House3-17"
            )
        kinds = [task_type] if task_type else self._kinds
        rooms = (scene,) if scene else self._spec.rooms
        for _ in range(_ROOMS):
            kind = kinds[int(rng.integers(len(kinds)))]
            name = rooms[int(rng.integers(len(rooms)))]
            layout = int(rng.integers(self._spec.layouts + 1))
            room = self._room(name, 0 if house else layout)
            tasks = [
                task
                for task in room.tasks([kind.name])
                if not rejection_reason(task, room, self._spec, self._verify)
            ]
            order: list[int] = rng.permutation(len(tasks)).tolist()
            for task in (tasks[number] for number in order[:_CANDIDATES]):
                verdict = self._verify(task)
                if verdict.solved:
                    return with_difficulty(task, room, verdict)
        asked = f"{task_type.name} " if task_type else ""
        raise ValueError(
            f"no {asked}task was found in {_ROOMS} arrangements of {scene or 'the rooms'}; "
            "ask for another type or room"
        )

    def find(self, task_id: str) -> Task:
        """Raise ValueError: generated tasks cannot be found by id."""
        raise ValueError(
            f"no task {short_repr(task_id)}: tasks that are generated live cannot be asked for "
            "by id; pass the Task itself"
        )

    def close(self) -> None:
        """Stop both engines."""
        self._controller.stop()
        self._verify.close()
