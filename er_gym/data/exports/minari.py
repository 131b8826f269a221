"""Minari: state observations and actions, for offline reinforcement learning.

Trajectories hold no state vectors, so each is played again in the environment that it was collected
in. One whose replay differs from the record is left out and counted.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from typing import Any

import numpy as np
from gymnasium.envs.registration import EnvSpec

from er_gym.data.collection import Collection
from er_gym.data.exports.base import ExportError, ExportFormat, ExportJob, needs
from er_gym.data.trajectory import Trajectory
from er_gym.envs.actions import ACTIONS, INDEX
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.resolve import resolve_tasks
from er_gym.tasks.suites import Suite, load_suite, suite_from_file

NAMESPACE = "er-gym"
_ENV_ID = "ER-Embodied-v0"
"""Names the environment in the data set. It is not registered: the spec says how it is made."""
_OTHERWISE = "it turned out otherwise when played again"


class _Replays:
    """Plays trajectories again, each in an environment like that of its part of the collection.

    Args:
        collection: what is exported.
        suite: the suite that was played.
        source: the suite's name, or its file.

    Attributes:
        env_spec: of the environment that Minari's ``recover_environment`` makes. It draws from the
            suite.
    """

    def __init__(self, collection: Collection, suite: Suite, source: str) -> None:
        wanted = {trajectory.task_id for trajectory in collection.trajectories()}
        fitted = resolve_tasks((each for each in suite.tasks if each.id in wanted), arrange=False)
        self._tasks = {task.id: task for task in fitted.tasks}
        self._parts = collection.parts()
        self._part, self._env = "", EmbodiedEnv((), **{**suite.env, "obs_mode": "state"})
        self._suite_env = suite.env
        self.env_spec = EnvSpec(
            id=_ENV_ID,
            entry_point=f"{EmbodiedEnv.__module__}:{EmbodiedEnv.__qualname__}",
            kwargs={**suite.env, "obs_mode": "state", "episode_source": source},
        )
        self.observation_space = self._env.observation_space
        self.action_space = self._env.action_space

    def play(self, trajectory: Trajectory) -> tuple[dict[str, Any] | None, str]:
        """The columns of an episode; or None, and why there are none."""
        task = self._tasks.get(trajectory.task_id)
        if task is None:
            return None, "its task is not among those of the suite that can be played"
        env = self._of(trajectory.part)
        obs, _ = env.reset(seed=trajectory.seed, options={"task": task})
        states = [obs["state"]]
        actions: list[int] = []
        rewards: list[float] = []
        ended: list[bool] = []
        cut: list[bool] = []
        for turn in trajectory.turns:
            if turn.action not in INDEX:
                return None, "a reply named no action"
            if ended and (ended[-1] or cut[-1]):
                return None, _OTHERWISE
            obs, reward, terminated, truncated, info = env.step(turn.action)
            if info["action_success"] != turn.success or not math.isclose(reward, turn.reward):
                return None, _OTHERWISE
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

    def _of(self, part: str) -> EmbodiedEnv:
        """The environment of a part; that of the part before is closed."""
        if part != self._part:
            self.close()
            arguments = self._parts[part].manifest.env if part in self._parts else self._suite_env
            self._part, self._env = part, EmbodiedEnv((), **{**arguments, "obs_mode": "state"})
        return self._env

    def close(self) -> None:
        """Close the environment."""
        self._env.close()


def _suite(job: ExportJob) -> Suite:
    """The suite that the collection was made of.

    Raises:
        ExportError: it is not to be had, or has other tasks now.
    """
    told, file = job.collection.manifest, job.options.tasks_file
    try:
        suite = load_suite(told.suite) if file is None else suite_from_file(file)
    except ValueError as error:
        raise ExportError(
            f"this format plays the trajectories again and needs the tasks of {told.suite!r:.100}: "
            f"{error}; give their file with --tasks-file"
        ) from error
    if suite.digest != told.suite_digest:
        raise ExportError(
            f"the tasks of {suite.name!r:.100} are not those that {job.collection.path} was played "
            "in; give the same file with --tasks-file, or use the er-gym that collected it"
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

    suite = _suite(job)
    with ExitStack() as stack:
        file = job.options.tasks_file
        source = job.collection.manifest.suite if file is None else str(file.resolve())
        replays = _Replays(job.collection, suite, source)
        stack.callback(replays.close)
        stores: dict[str, Any] = {}
        for split, trajectory in job.trajectories():
            columns, why = replays.play(trajectory)
            if columns is None:
                job.leave_out(why)
                continue
            job.take(trajectory)
            if split not in stores:
                # Minari joins a relative path with itself.
                folder = job.folder.resolve() / NAMESPACE / f"{split}-v0" / "data"
                folder.mkdir(parents=True)
                stores[split] = MinariStorage.new(
                    folder,
                    observation_space=replays.observation_space,
                    action_space=replays.action_space,
                    env_spec=replays.env_spec,
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


MINARI = ExportFormat(
    name="minari",
    about="Minari: state observations and actions, for offline RL",
    write=_write,
    usage="""\
```python
import os
os.environ["MINARI_DATASETS_PATH"] = "THIS FOLDER"

import minari
dataset = minari.load_dataset("er-gym/train-v0")[[  # and er-gym/validation-v0]]
```

Observations are `{"state": …}` of `EmbodiedEnv(obs_mode="state")`, actions are indices of
`er_gym.envs.actions.ACTIONS`; the names of both versions of this list are compared with the
metadata entry `actions`. Episodes come from playing each trajectory again.
`dataset.recover_environment()` makes the environment, with the tasks of the suite.
""",
)
