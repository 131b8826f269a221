"""The learner's observation, the same in training and when the policy plays a suite."""

from __future__ import annotations

import pickle
import zlib
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from PIL import Image

from agents.rl.config import EnvConfig
from agents.rl.object_map import MAP_LAYOUT, ObjectMap
from agents.rl.sighting_memory import SIGHTING_LAYOUT, SightingMemory
from agents.rl.subtask_memory import SUBTASK_LAYOUT, SubtaskMemory
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.info import with_details
from er_gym.envs.observations import STATE_LAYOUT
from er_gym.envs.wrappers import make_encoder
from er_gym.tasks import verbs

Obs = dict[str, NDArray[Any]]
IMAGES = {"rgb": 3, "depth": 1}
"""The observations that a network sees as images, with their numbers of channels."""
_END = INDEX[Action(verbs.END)]
DEPTH_RANGE = 10.0
"""Metres; few rooms are longer."""


class PolicyObservation:
    """Makes the learner's observation from the environment's.

    - ``state``: as in the environment's observation.
    - ``subtask``: (S,) float32 in [0, 1], see :mod:`agents.rl.subtask_memory`.
    - ``sightings``: (S,) float32 in [0, 1], see :mod:`agents.rl.sighting_memory`.
    - ``object_map``: (S,) float32 in [0, 1], see :mod:`agents.rl.object_map`.
    - ``instruction``: (E,) float32 in [-1, 1], with an encoder.
    - ``rgb``: (height, width, 3 × frames) uint8, the last pictures, the newest last; at the
      beginning the first is repeated.
    - ``depth``: (height, width, frames) uint8, the same of the last depths; 255 is
      :data:`DEPTH_RANGE` and beyond.
    - ``mask``: (A,) int8, the legal actions, for algorithms that read them from the observation.
    """

    def __init__(self, options: EnvConfig, with_mask: bool = False) -> None:
        self._size = (options.width, options.height)
        self._encode = make_encoder(options.instruction) if options.instruction else None
        self._with_mask = with_mask
        self._ends_when_done = options.ends_when_done
        entries: dict[str, spaces.Space[Any]] = {
            "state": spaces.Box(-1.0, 1.0, (len(STATE_LAYOUT),), np.float32)
        }
        self._with_subtasks = options.subtasks
        self.subtasks: SubtaskMemory | None = None
        if options.subtasks:
            entries["subtask"] = spaces.Box(0.0, 1.0, (len(SUBTASK_LAYOUT),), np.float32)
        self._with_sightings = options.sightings
        self._sightings: SightingMemory | None = None
        if options.sightings:
            entries["sightings"] = spaces.Box(0.0, 1.0, (len(SIGHTING_LAYOUT),), np.float32)
        self._with_map = options.object_map
        self._map: ObjectMap | None = None
        if options.object_map:
            entries["object_map"] = spaces.Box(0.0, 1.0, (len(MAP_LAYOUT),), np.float32)
        if self._encode is not None:
            entries["instruction"] = spaces.Box(-1.0, 1.0, (self._encode.dimension,), np.float32)
        self._images: dict[str, deque[NDArray[np.uint8]]] = {
            name: deque(maxlen=options.frames)
            for name in options.obs_mode.split("+")
            if name in IMAGES
        }
        for name in self._images:
            shape = (options.height, options.width, IMAGES[name] * options.frames)
            entries[name] = spaces.Box(0, 255, shape, np.uint8)
        if with_mask:
            entries["mask"] = spaces.Box(0, 1, (len(ACTIONS),), np.int8)
        self.space = spaces.Dict(entries)

    def reset(self, obs: Mapping[str, Any], info: Mapping[str, Any], instruction: str) -> Obs:
        """The first observation of an episode."""
        for images in self._images.values():
            images.clear()
        self.subtasks = SubtaskMemory(instruction) if self._with_subtasks else None
        self._sightings = self._map = None
        if self._with_sightings:
            assert self.subtasks is not None  # the configuration sees to it
            self._sightings = SightingMemory(self.subtasks.progress)
            self._map = ObjectMap(self.subtasks.progress) if self._with_map else None
        self._told = self._encode(instruction) if self._encode is not None else None
        return self.observe(obs, info)

    def info_of(self, env: Any, info: Mapping[str, Any]) -> Mapping[str, Any]:
        """``info`` with what else of a step of ``env`` is observed."""
        return with_details(env, info) if self._with_sightings else info

    def observe(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Obs:
        """The next one; for sightings, ``info`` has details (:meth:`info_of`)."""
        made: Obs = {"state": obs["state"]}
        if self.subtasks is not None:
            made["subtask"] = self.subtasks.update(info)
        if self._sightings is not None:
            made["sightings"] = self._sightings.update(info)
        if self._map is not None:
            made["object_map"] = self._map.update(obs["state"], info)
        if self._told is not None:
            made["instruction"] = self._told
        for name, images in self._images.items():
            image = self._image(obs[name])
            while len(images) < (images.maxlen or 1) - 1:
                images.append(image)
            images.append(image)
            made[name] = np.concatenate(images, axis=2)
        if self._with_mask:
            made["mask"] = self.allowed(info)
        return made

    def allowed(self, info: Mapping[str, Any]) -> NDArray[np.int8]:
        """(A,) int8, the legal actions between which the learner chooses after :meth:`observe`:
        with ``ends_when_done``, ``end`` is none of them before it is time."""
        mask: NDArray[np.int8] = info["action_mask"]
        if self._ends_when_done and info["max_steps"] - info["steps"] > 1:
            assert self.subtasks is not None  # the configuration sees to it
            if self.subtasks.progress.at() is not None:  # observe is always legal, too
                mask = mask.copy()
                mask[_END] = 0
        return mask

    def memory(self) -> bytes:
        """What is remembered of the earlier observations, for :meth:`recall` in this program."""
        kept = self.subtasks, self._sightings, self._map, self._told, self._images
        return zlib.compress(pickle.dumps(kept), 1)

    def recall(self, memory: bytes) -> None:
        """Remember that in place of this episode's; the next is :meth:`observe`."""
        kept = pickle.loads(zlib.decompress(memory))
        self.subtasks, self._sightings, self._map, self._told, self._images = kept

    def _image(self, seen: NDArray[Any]) -> NDArray[np.uint8]:
        """A picture or a depth as (height, width, channels) uint8 of the learner's size."""
        if seen.ndim == 2:
            seen = (np.minimum(seen / DEPTH_RANGE, 1.0) * 255).round().astype(np.uint8)
        if seen.shape[1::-1] != self._size:
            seen = np.asarray(Image.fromarray(seen).resize(self._size, Image.Resampling.BOX))
        return seen.reshape(*self._size[::-1], -1)
