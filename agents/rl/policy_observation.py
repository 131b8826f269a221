"""The learner's observation, the same in training and when the policy plays a suite."""

from __future__ import annotations

import pickle
import zlib
from collections import deque
from collections.abc import Mapping, Sequence
from itertools import islice
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from PIL import Image

from agents.rl.config import EnvConfig
from agents.rl.sighting_memory import SIGHTING_LAYOUT, SightingMemory
from agents.rl.subtask_memory import SUBTASK_LAYOUT, SubtaskMemory
from agents.rl.subtasks import Progress
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.info import detail, with_details
from er_gym.envs.object_view import ObjectView, lies_elsewhere
from er_gym.envs.observations import STATE_LAYOUT
from er_gym.envs.wrappers import make_encoder
from er_gym.tasks import verbs

Obs = dict[str, NDArray[Any]]
IMAGES = {"rgb": 3, "depth": 1}
"""The observations that a network sees as images, with their numbers of channels."""
_PLACE = {name: place for place, name in enumerate(SUBTASK_LAYOUT)}
_CAN = "can {action.verb}:{action.object_type}"
DEPTH_RANGE = 10.0
"""Metres; few rooms are longer."""


class PolicyObservation:
    """Makes the learner's observation from the environment's.

    - ``state``: as in the environment's observation.
    - ``subtask``: (S,) float32 in [0, 1], see :mod:`agents.rl.subtask_memory`.
    - ``sightings``: (S,) float32 in [0, 1], see :mod:`agents.rl.sighting_memory`.
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
        entries: dict[str, spaces.Space[Any]] = {
            "state": spaces.Box(-1.0, 1.0, (len(STATE_LAYOUT),), np.float32)
        }
        self._with_subtasks = options.subtasks
        self.subtasks: SubtaskMemory | None = None
        if options.subtasks:
            entries["subtask"] = spaces.Box(0.0, 1.0, (len(SUBTASK_LAYOUT),), np.float32)
        self._only_from_source = options.only_from_source
        self._elsewhere: Action | None = None  # to pick up what is not where it is said to be
        self._with_sightings = options.sightings
        self._sightings: SightingMemory | None = None
        if options.sightings:
            entries["sightings"] = spaces.Box(0.0, 1.0, (len(SIGHTING_LAYOUT),), np.float32)
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
        self._sightings = None
        if self._with_sightings:
            assert self.subtasks is not None  # the configuration sees to it
            self._sightings = SightingMemory(self.subtasks.progress)
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
            if self._only_from_source:
                self._elsewhere = _elsewhere(self.subtasks.progress, info)
                if self._elsewhere is not None:
                    made["subtask"][_PLACE[_CAN.format(action=self._elsewhere)]] = 0.0
        if self._sightings is not None:
            made["sightings"] = self._sightings.update(info)
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
        """(A,) int8, the legal actions between which the learner chooses after :meth:`observe`;
        with ``only_from_source``, not to pick up what lies elsewhere."""
        mask: NDArray[np.int8] = info["action_mask"]
        if self._elsewhere is not None:
            mask = mask.copy()
            mask[INDEX[self._elsewhere]] = 0
        return mask

    def memory(self) -> bytes:
        """What is remembered of the earlier observations, for :meth:`recall` in this program."""
        kept = self.subtasks, self._sightings, self._told, self._images
        return zlib.compress(pickle.dumps(kept), 1)

    def recall(self, memory: bytes) -> None:
        """Remember that in place of this episode's; the next is :meth:`observe`."""
        kept = pickle.loads(zlib.decompress(memory))
        self.subtasks, self._sightings, self._told, self._images = kept

    def _image(self, seen: NDArray[Any]) -> NDArray[np.uint8]:
        """A picture or a depth as (height, width, channels) uint8 of the learner's size."""
        if seen.ndim == 2:
            seen = (np.minimum(seen / DEPTH_RANGE, 1.0) * 255).round().astype(np.uint8)
        if seen.shape[1::-1] != self._size:
            seen = np.asarray(Image.fromarray(seen).resize(self._size, Image.Resampling.BOX))
        return seen.reshape(*self._size[::-1], -1)


def _elsewhere(progress: Progress, info: Mapping[str, Any]) -> Action | None:
    """To pick up the thing of the subtask at hand, if the instruction says where it lies and the
    nearest in view, which would be picked up, lies elsewhere; otherwise None, as once it has been
    picked up, since it may have been put anywhere."""
    now = progress.at()
    if now is None or not now.source or now.verb != verbs.PICKUP:
        return None
    action = Action(now.verb, now.thing)
    if progress.number < progress.furthest or action not in INDEX:
        return None
    views: Sequence[ObjectView] = detail(info, "object_views")
    nearest = islice((view for view in views if view.object_type == now.thing), 1)
    return action if lies_elsewhere(now.thing, now.source, nearest) else None
