"""Minari: a wrapper that records episodes, whoever plays them, as a ``MinariDataset``.

Minari's own ``DataCollector`` works, too, but needs JAX and takes no texts of actions. Episodes
that ``er-gym collect`` has made are exported by ``er-gym data export --to minari``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import h5py  # noqa: F401  (Minari's storage needs it, and says so late)
import numpy as np
from gymnasium import spaces
from minari import MinariDataset, create_dataset_from_buffers
from minari.data_collector import EpisodeBuffer

from er_gym.envs.actions import ACTIONS, INDEX
from er_gym.envs.info import action_of


class Recorder(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Keeps the observations, actions, rewards and ends of each episode.

    An episode is kept when the next one begins, or when the data set is made. One that is not over
    then is cut there; one in which something was said that names no action is left out, since
    Minari's actions are those of the action space.

    Args:
        env: what ``gymnasium.make`` returns, or an ``EmbodiedEnv``.
        observe: the observations to record, of those that the environment has.

    Attributes:
        left_out: how many episodes were left out.

    Raises:
        ValueError: the environment lacks one of the observations.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], observe: Sequence[str] = ("state",)) -> None:
        super().__init__(env)
        space = env.observation_space
        seen = space.spaces if isinstance(space, spaces.Dict) else {}
        lacking = [name for name in observe if name not in seen]
        if lacking:
            raise ValueError(
                f"the environment has no observation {lacking[0]!r}; make it with "
                f"obs_mode={'+'.join(observe)!r}"
            )
        self._seen = spaces.Dict({name: seen[name] for name in observe})
        self._buffers: list[EpisodeBuffer] = []
        self._about: list[dict[str, Any]] = []
        self._info: dict[str, Any] = {}
        self._now: EpisodeBuffer | None = None
        self.left_out = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode, and keep the one before."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._keep()
        columns: dict[str, list[Any]] = {name: [obs[name]] for name in self._seen}
        self._now = EpisodeBuffer(seed=seed, observations=columns, actions=[])
        self._info = info
        return obs, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Do an action."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        said = action_of(info)
        now, self._info = self._now, info
        if now is not None and said is None:
            self._now, self.left_out = None, self.left_out + 1
        elif now is not None and said is not None:
            for name in self._seen:
                now.observations[name].append(obs[name])
            now.actions.append(INDEX[said])
            now.rewards.append(float(reward))
            now.terminations.append(bool(terminated))
            now.truncations.append(bool(truncated))
        return obs, reward, terminated, truncated, info

    def create_dataset(self, dataset_id: str, **about: Any) -> MinariDataset:
        """Write what was recorded so far, and begin anew.

        Args:
            dataset_id: such as ``"er-gym/mine-v0"``. Minari's folder is that of the environment
                variable ``MINARI_DATASETS_PATH``.
            about: further arguments of ``minari.create_dataset_from_buffers``, such as
                ``algorithm_name``.

        Raises:
            ValueError: no episode was recorded, or there is such a data set.
        """
        self._keep()
        if not self._buffers:
            raise ValueError("no episode was recorded: play one between reset() and this")
        dataset = create_dataset_from_buffers(
            dataset_id,
            self._buffers,
            env=self.env.spec,
            observation_space=self._seen,
            action_space=self.env.action_space,
            **about,
        )
        places = list(range(len(self._about)))
        dataset.storage.update_episode_metadata(self._about, places)
        dataset.storage.update_metadata({"actions": [str(action) for action in ACTIONS]})
        self._buffers, self._about = [], []
        return dataset

    def _keep(self) -> None:
        """Keep the episode under way, if it has a step."""
        now, self._now = self._now, None
        if now is None or not now.actions:
            return
        now.truncations[-1] = now.truncations[-1] or not now.terminations[-1]
        columns = {name: np.stack(rows) for name, rows in now.observations.items()}
        self._buffers.append(
            EpisodeBuffer(
                id=len(self._buffers),
                seed=now.seed,
                observations=columns,
                actions=np.array(now.actions, dtype=np.int64),
                rewards=now.rewards,
                terminations=now.terminations,
                truncations=now.truncations,
            )
        )
        told = ("task_id", "task_type", "instruction", "success", "end_reason")
        self._about.append({name: self._info[name] for name in told})
