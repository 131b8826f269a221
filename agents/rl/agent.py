"""Plays any suite with a trained policy."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch

from agents.rl.config import load_config
from agents.rl.greedy import GreedyPolicy
from agents.rl.policy_file import CONFIG, policy_file
from agents.rl.policy_observation import Obs, PolicyObservation
from er_gym.envs.actions import ACTIONS, Action
from er_gym.rollout.agent import Decision, check_observation
from er_gym.tasks.task import Task


class RLAgent:
    """The policy of a run directory; it acts deterministically.

    Its observations are made as in training: pictures have the same size, and instructions the same
    encoding. From ``info`` it reads the action mask.

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
        self.obs_mode: str = config.env.obs_mode

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode.

        Raises:
            ValueError: the environment does not give the observations of ``obs_mode``.
        """
        check_observation(self, obs)
        self._instruction: str | None = task.instruction

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The policy's best action."""
        return Decision(ACTIONS[self._policy.best(self._see(obs, info), info["action_mask"])])

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Somebody else decides this step; what is seen before it is remembered as ever."""
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
