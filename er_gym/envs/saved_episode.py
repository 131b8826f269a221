"""The part of an environment that saves its episode, goes back to it, and copies itself."""

from __future__ import annotations

import copy
import threading
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import gymnasium
import numpy as np
from gymnasium.utils import EzPickle

from er_gym.envs.arguments import whole_number
from er_gym.envs.episode import Episode, EpisodeSettings, ResetResult
from er_gym.envs.faults import FaultPlan
from er_gym.envs.snapshot import (
    SnapshotError,
    generator_of,
    generator_state,
    pack,
    unpack,
    vocabulary,
)
from er_gym.tasks.arrangement import set_up_scene
from er_gym.tasks.jsonl_format import task_lines, task_of_lines
from er_gym.tasks.task import Task

BROKEN_OFF = "the last reset or step was broken off by an error"
"""Why no episode is under way while one begins, goes on or is restored, and after an error."""
Env = TypeVar("Env", bound="SavedEpisode")


class SavedEpisode(EzPickle):
    """A base of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`, whose attributes it reads."""

    _lock: threading.RLock
    _backend: str
    _settings: EpisodeSettings
    _controller_arguments: dict[str, Any]
    _episode: Episode | None
    _no_episode: str
    _outer_limit: int | None
    _faults: FaultPlan
    _np_random: np.random.Generator | None
    _np_random_seed: int | None

    if TYPE_CHECKING:  # what the environment has
        np_random: np.random.Generator
        action_space: Any

        def _current(self, before: str) -> Episode: ...
        def _started_controller(self, scene: str) -> Any: ...
        def _new_episode(
            self, task: Task, controller: Any, faults: FaultPlan | None, replies: int | None
        ) -> Episode: ...
        def _show(self) -> None: ...

    def snapshot(self) -> bytes:
        """The episode as it is now, some kilobytes, for :meth:`restore` in any process.

        It holds the task, the objects, the agent, its memory, the progress, the faults to come and
        the random numbers from which ``reset`` draws. It does not hold the environment's arguments,
        third-party cameras, or what wrappers know.

        Raises:
            ResetNeeded: no episode is under way.
            gymnasium.error.Error: ``backend="unity"``, whose state is not known.
        """
        with self._lock:
            episode = self._current("snapshot()")
            self._refuse_unity()
            return pack(
                {
                    "arguments": self._deciding_arguments(),
                    "task": task_lines(episode.task),
                    "episode": episode.state(),
                    "outer_limit": self._outer_limit,
                    "random": [generator_state(self.np_random), str(self._np_random_seed)],
                }
            )

    def restore(self, snapshot: bytes) -> ResetResult:
        """Go on with the episode of a snapshot, in place of the one under way.

        Args:
            snapshot: of this environment or of one with the same arguments, except for those that
                choose what is observed, drawn and subtracted from the reward.

        Returns:
            The observation and ``info`` of the snapshot's last step.

        Raises:
            SnapshotError: it is damaged, of another version, or of an environment with other
                arguments; the episode under way goes on. Or its content is none that
                :meth:`snapshot` writes, which is seen while it is taken up: then none is under way.
        """
        saved = unpack(snapshot)
        with self._lock:
            try:
                self._check_arguments(saved["arguments"])
                task = _saved_task(tuple(saved["task"]))
                random, seed = saved["random"]
                generator, seed = generator_of(random), int(seed)
                answer = self._resume(task, saved["episode"], saved["outer_limit"])
            except SnapshotError:
                raise
            except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
                reason = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
                raise SnapshotError(
                    f"the content of the snapshot is none that snapshot() writes ({reason})"
                ) from error
            self._np_random, self._np_random_seed = generator, seed
            self._show()
            return answer

    def _check_arguments(self, saved: Mapping[str, Any]) -> None:
        for name, own in self._deciding_arguments().items():
            other = saved.get(name)
            if other != own:
                raise SnapshotError(
                    f"the snapshot is of an environment with another {name}: {other!r}, and "
                    f"this one has {own!r}"
                )

    def fork(self: Env, n: int) -> list[Env]:
        """n environments like this one, in each of which the episode goes on by itself.

        Raises:
            ResetNeeded: no episode is under way.
            ValueError: n is not a whole number of at least 1.
            gymnasium.error.Error: ``backend="unity"``, whose state is not known.
        """
        n = whole_number("n", n, 1)
        with self._lock:
            self._current("fork()")
            self._refuse_unity()
            return [copy.deepcopy(self) for _ in range(n)]

    def _refuse_unity(self) -> None:
        if self._backend != "embedded":
            raise gymnasium.error.Error(
                f"an episode on backend {self._backend!r} cannot be copied or saved, since that "
                "engine does not tell its state: copy the environment before reset(), or reset "
                "another with options={'task': env.unwrapped.task} and do the same actions there"
            )

    def _deciding_arguments(self) -> dict[str, Any]:
        """The arguments that decide what an action does, and what counts as success."""
        controller, settings = self._controller_arguments, self._settings
        return {
            "backend": self._backend,
            "protocol": settings.protocol.name,
            "instances": settings.instances,
            "max_steps": settings.max_steps,
            "grid_size": settings.grid_size,
            "field_of_view": controller["fieldOfView"],
            "visibility_distance": controller["visibilityDistance"],
            "width / height": controller["width"] / controller["height"],
            "table of object types and actions": vocabulary(),
        }

    def _resume(self, task: Task, state: Mapping[str, Any], replies: int | None) -> ResetResult:
        """Take up an episode in the state that :meth:`.Episode.state` told."""
        arranged = not self._no_episode and _same_room(self._current("resuming").task, task)
        self._no_episode = BROKEN_OFF  # until this has succeeded
        controller = self._started_controller(task.scene)
        if not arranged:
            set_up_scene(controller, task.scene, task.arrangement)
        faults = None if state["faults"] is None else FaultPlan.of_state(state["faults"])
        self._episode = self._new_episode(task, controller, faults, replies)
        answer = self._episode.resume(state)
        self._no_episode = ""
        return answer

    def __getstate__(self) -> dict[str, Any]:
        """The state of a copy: the arguments, the task, and the episode as it is.

        Raises:
            gymnasium.error.Error: an episode is under way on ``backend="unity"``.
        """
        with self._lock:
            if not self._no_episode:
                self._refuse_unity()
            episode = None if self._no_episode else self._current("copying")
            return {
                **EzPickle.__getstate__(self),
                "random": (self._np_random, self._np_random_seed, self.action_space),
                "no_episode": self._no_episode,
                "episode": episode and (episode.task, episode.state(), self._outer_limit),
                "faults": self._faults,
            }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the environment anew, and take up the episode."""
        EzPickle.__setstate__(self, state)
        self._faults = state["faults"]
        if state["episode"] is not None:
            self._resume(*state["episode"])
        self._no_episode = state["no_episode"]
        self._np_random, self._np_random_seed, self.action_space = state["random"]


@lru_cache(maxsize=256)
def _saved_task(lines: tuple[str, ...]) -> Task:
    """The task of a snapshot; a search goes back to those of few tasks many times."""
    return task_of_lines(lines)


def _same_room(one: Task, other: Task) -> bool:
    """Whether the episodes of two tasks begin in one scene with the objects in the same places."""
    return one.scene == other.scene and one.arrangement.poses == other.arrangement.poses
