"""The learner's observation, the same in training and when the policy plays a suite."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from PIL import Image

from agents.rl.config import EnvConfig
from er_gym.envs.actions import ACTIONS
from er_gym.envs.observations import STATE_LAYOUT
from er_gym.envs.wrappers import make_encoder

Obs = dict[str, NDArray[Any]]


class PolicyObservation:
    """Makes the learner's observation from the environment's.

    - ``state``: as in the environment's observation.
    - ``instruction``: (E,) float32 in [-1, 1], with an encoder.
    - ``rgb``: (height, width, 3 × frames) uint8, the last pictures, the newest last; at the
      beginning the first is repeated.
    - ``mask``: (A,) int8, the legal actions, for algorithms that read them from the observation.
    """

    def __init__(self, options: EnvConfig, with_mask: bool = False) -> None:
        self._size = (options.width, options.height)
        self._frames: deque[NDArray[np.uint8]] = deque(maxlen=options.frames)
        self._encode = make_encoder(options.instruction) if options.instruction else None
        self._with_mask = with_mask
        entries: dict[str, spaces.Space[Any]] = {
            "state": spaces.Box(-1.0, 1.0, (len(STATE_LAYOUT),), np.float32)
        }
        if self._encode is not None:
            entries["instruction"] = spaces.Box(-1.0, 1.0, (self._encode.dimension,), np.float32)
        self._sees = "rgb" in options.obs_mode.split("+")
        if self._sees:
            shape = (options.height, options.width, 3 * options.frames)
            entries["rgb"] = spaces.Box(0, 255, shape, np.uint8)
        if with_mask:
            entries["mask"] = spaces.Box(0, 1, (len(ACTIONS),), np.int8)
        self.space = spaces.Dict(entries)

    def reset(self, obs: Mapping[str, Any], info: Mapping[str, Any], instruction: str) -> Obs:
        """The first observation of an episode."""
        self._frames.clear()
        self._told = self._encode(instruction) if self._encode is not None else None
        return self.observe(obs, info)

    def observe(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Obs:
        """The next one."""
        made: Obs = {"state": obs["state"]}
        if self._told is not None:
            made["instruction"] = self._told
        if self._sees:
            picture = obs["rgb"]
            if picture.shape[1::-1] != self._size:
                small = Image.fromarray(picture).resize(self._size, Image.Resampling.BOX)
                picture = np.asarray(small)
            while len(self._frames) < (self._frames.maxlen or 1) - 1:
                self._frames.append(picture)
            self._frames.append(picture)
            made["rgb"] = np.concatenate(self._frames, axis=2)
        if self._with_mask:
            made["mask"] = info["action_mask"]
        return made
