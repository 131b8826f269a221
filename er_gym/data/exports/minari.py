"""Minari: state observations and actions, for offline reinforcement learning.

Trajectories hold no state vectors, so each is played again in the environment that it was collected
in. One that does not turn out as recorded is left out and counted.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np

from er_gym.data.exports.base import ExportError, ExportFormat, ExportJob, needs
from er_gym.data.trajectory import Trajectory
from er_gym.envs.actions import ACTIONS, INDEX
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.suites import Suite, load_suite, suite_from_file
from er_gym.tasks.task import Task

NAMESPACE = "er-gym"
_PLAYING = (
    *("backend", "width", "height", "field_of_view", "grid_size", "visibility_distance"),
    *("instances", "protocol", "step_penalty", "illegal_penalty"),
)
"""The arguments of the environment that decide how an episode goes. The shape of the view is among
them, since only what is in view can be gone to."""


class _Replays:
    """Plays trajectories again, in an environment for each step limit.

    Args:
        tasks: by id.
        env: keyword arguments of ``EmbodiedEnv``.
    """

    def __init__(self, tasks: Mapping[str, Task], env: Mapping[str, Any]) -> None:
        self._tasks, self._arguments = tasks, dict(env)
        self._envs: dict[int, EmbodiedEnv] = {}

    def env(self, max_steps: int) -> EmbodiedEnv:
        if max_steps not in self._envs:
            arguments = {**self._arguments, "obs_mode": "state", "max_steps": max_steps}
            self._envs[max_steps] = EmbodiedEnv((), **arguments)
        return self._envs[max_steps]

    def play(self, trajectory: Trajectory) -> tuple[dict[str, Any] | None, str]:
        """The columns of an episode; or None, and why there are none."""
        if trajectory.task_id not in self._tasks:
            return None, "the task is not in the suite"
        if any(turn.fault for turn in trajectory.turns):
            return None, "an injected fault"
        env = self.env(trajectory.max_steps)
        options = {"task": self._tasks[trajectory.task_id]}
        obs, _ = env.reset(seed=trajectory.seed, options=options)
        states = [obs["state"]]
        rewards: list[float] = []
        actions: list[int] = []
        ended: list[bool] = []
        cut: list[bool] = []
        for turn in trajectory.turns:
            if turn.action not in INDEX or (ended and (ended[-1] or cut[-1])):
                return None, "it turned out otherwise when played again"
            obs, reward, terminated, truncated, info = env.step(turn.action)
            if info["action_success"] != turn.success or not math.isclose(reward, turn.reward):
                return None, "it turned out otherwise when played again"
            states.append(obs["state"])
            actions.append(INDEX[turn.action])
            rewards.append(float(reward))
            ended.append(bool(terminated))
            cut.append(bool(truncated))
        cut[-1] = cut[-1] or not ended[-1]  # Minari's episodes end
        columns = {
            "observations": {"state": np.stack(states)},
            "actions": np.array(actions, dtype=np.int64),
            "rewards": rewards,
            "terminations": ended,
            "truncations": cut,
        }
        return columns, ""

    def close(self) -> None:
        for env in self._envs.values():
            env.close()


def _suite(job: ExportJob) -> Suite:
    """The suite that the collection was made of.

    Raises:
        ExportError: it is not to be had, or has other tasks now.
    """
    wanted = job.collection.manifest
    try:
        suite = load_suite(wanted.suite)
    except ValueError as error:
        raise ExportError(
            f"this format plays the trajectories again and needs the collection's suite "
            f"{wanted.suite!r}: {error}; or give its task file (--tasks)"
        ) from error
    if suite.digest != wanted.suite_digest:
        raise ExportError(
            f"the suite {wanted.suite!r} has other tasks than when the collection was made; "
            "give the task file of then (--tasks)"
        )
    return suite


def _write(job: ExportJob) -> None:
    try:
        import h5py  # noqa: F401  (Minari's storage needs it, and says so late)
        from minari.data_collector import EpisodeBuffer
        from minari.dataset.minari_storage import MinariStorage
    except ImportError as error:
        raise needs("minari", "minari", error) from error
    from er_gym import __version__

    settings = job.collection.manifest.settings.get("env", {})
    env = {name: settings[name] for name in _PLAYING if name in settings}
    if job.options.tasks is None:
        suite = _suite(job)
        tasks: Mapping[str, Task] = {task.id: task for task in suite.tasks}
        env = {**{k: v for k, v in suite.env.items() if k in _PLAYING}, **env}
    else:
        tasks = job.options.tasks
    with ExitStack() as stack:
        replays = _Replays(tasks, env)
        stack.callback(replays.close)
        spaces = replays.env(1)
        stores: dict[str, Any] = {}
        for split, trajectory in job.trajectories():
            columns, why = replays.play(trajectory)
            if columns is None:
                job.leave_out(why)
                continue
            job.take(trajectory)
            if split not in stores:
                folder = job.folder / NAMESPACE / f"{split}-v0" / "data"
                folder.mkdir(parents=True)
                stores[split] = MinariStorage.new(
                    folder,
                    observation_space=spaces.observation_space,
                    action_space=spaces.action_space,
                    data_format="hdf5",
                )
            place = stores[split].total_episodes
            stores[split].update_episodes([EpisodeBuffer(seed=trajectory.seed, **columns)])
            stores[split].update_episode_metadata([_about(trajectory)], [place])
            job.add(split, 0)
        for name, store in stores.items():
            store.update_metadata(
                {
                    "dataset_id": f"{NAMESPACE}/{name}-v0",
                    "algorithm_name": "er-gym collect",
                    "author": {"er-gym"},
                    "description": "Household tasks in AI2-THOR rooms, played by an expert: state "
                    "observations and discrete actions of EmbodiedEnv (obs_mode='state').",
                    "minari_version": _minari_version(),
                    "requirements": [f"er-gym=={__version__}"],
                    "actions": [str(action) for action in ACTIONS],
                }
            )


def _minari_version() -> str:
    from importlib.metadata import version

    return version("minari")


def _about(trajectory: Trajectory) -> dict[str, Any]:
    """What Minari keeps of an episode beside its steps."""
    return {
        "trajectory": trajectory.id,
        "task": trajectory.task_id,
        "task_type": trajectory.task_type,
        "scene": trajectory.scene,
        "instruction": trajectory.instruction,
        "part": trajectory.part,
        "kind": trajectory.kind,
        "success": trajectory.success,
    }


def tasks_by_id(suite_or_file: str) -> Iterator[tuple[str, Task]]:
    """The tasks of a suite or a task file, by id.

    Raises:
        ValueError: there is no such suite or file.
    """
    from pathlib import Path

    path = Path(suite_or_file)
    suite = suite_from_file(path) if path.is_file() else load_suite(suite_or_file)
    return ((task.id, task) for task in suite.tasks)


MINARI = ExportFormat(
    name="minari",
    about="Minari: state observations and actions, for offline RL",
    write=_write,
    usage="""\
```python
import os
os.environ["MINARI_DATASETS_PATH"] = "THIS FOLDER"

import minari
dataset = minari.load_dataset("er-gym/train-v0")  # and er-gym/validation-v0
```

Observations are `{"state": …}` of `EmbodiedEnv(obs_mode="state")`, actions are indices of
`er_gym.envs.actions.ACTIONS`; the names of both versions of this list are compared with the
metadata entry `actions`. Episodes come from playing each trajectory again.
""",
)
