"""Plays any suite with a trained policy."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from agents.rl.config import load_config
from agents.rl.network import TypeNetwork
from agents.rl.policy_file import CONFIG, load_network, policy_file
from agents.rl.policy_observation import IMAGES, Obs, PolicyObservation
from er_gym.envs.actions import ACTIONS, Action
from er_gym.rollout.agent import Decision, check_observation
from er_gym.tasks.task import Task


class GreedyPolicy:
    """Chooses the action that the learner of a model file would choose without exploring.

    That is the most probable one for MaskablePPO and the most valuable one for DQN and QR-DQN. The
    value of the state, which learners add to the value of every action, does not change the choice
    and is left out.

    Args:
        network: trained.
    """

    def __init__(self, network: TypeNetwork) -> None:
        self._network = network

    @staticmethod
    def load(file: Path) -> GreedyPolicy:
        """Load a model file; see :func:`.policy_file.load_network`."""
        return GreedyPolicy(load_network(file))

    def best(self, seen: Obs, mask: NDArray[np.int8]) -> int:
        """The index of an action.

        Args:
            seen: an observation of :class:`.policy_observation.PolicyObservation`.
            mask: (A,), not 0 where an action is legal.
        """
        obs = {name: _tensor(name, array) for name, array in seen.items()}
        with torch.no_grad():
            numbers, _ = self._network(obs)  # (1, A, outputs)
            values = numbers[0].mean(dim=1)
            return int(values.masked_fill(torch.from_numpy(mask == 0), -torch.inf).argmax())


def _tensor(name: str, array: NDArray[Any]) -> torch.Tensor:
    """(1, …) float32; pictures (1, channels, height, width), from 0 to 1."""
    tensor = torch.as_tensor(array)[None].float()
    return tensor.permute(0, 3, 1, 2) / 255 if name in IMAGES else tensor


class RLAgent:
    """The policy of a run directory; it acts deterministically.

    Its observations are made as in training: pictures have the same size, and instructions the same
    encoding. From ``info`` it reads the action mask and what ``env.subtasks`` and ``env.sightings``
    name; the latter needs details (:func:`er_gym.envs.info.with_details`).

    Args:
        path: the run directory, or a model file with its ``config.yaml`` beside it: ``model.npz``
            or ``policy.safetensors``.

    Raises:
        ValueError: the run does not exist, or its model cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        file = policy_file(Path(path))
        config = load_config(file.parent / CONFIG)
        self._policy = _loaded(file, file.stat().st_mtime_ns)
        self._policy_observation = PolicyObservation(config.env)
        self.obs_mode: str = config.env.needed_obs_mode

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode.

        Raises:
            ValueError: the environment does not give the observations of ``obs_mode``.
        """
        check_observation(self, obs)
        self._instruction: str | None = task.instruction

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The policy's best action."""
        seen = self._see(obs, info)
        return Decision(ACTIONS[self._policy.best(seen, self._policy_observation.allowed(info))])

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Another decides this step; the observation before it is remembered as usual."""
        self._see(obs, info)

    def _see(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Obs:
        """The policy's observation, which remembers the earlier ones."""
        if self._instruction is None:
            return self._policy_observation.observe(obs, info)
        instruction, self._instruction = self._instruction, None
        return self._policy_observation.reset(obs, info, instruction)


@lru_cache(maxsize=4)
def _loaded(file: Path, changed: int) -> GreedyPolicy:
    """Load the policy of a file; the cache serves many episodes while the file is unchanged."""
    torch.set_num_threads(1)  # observations come one at a time, and several workers may run
    return GreedyPolicy.load(file)
