"""Plays any suite with a trained policy."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch

from agents.rl.config import load_config
from agents.rl.model_file import MODEL, SB3_MODEL, untrusted_model
from agents.rl.policy_observation import PolicyObservation
from agents.rl.train import ALGORITHMS, CONFIG, load_model
from er_gym.envs.actions import ACTIONS
from er_gym.rollout.agent import Decision
from er_gym.tasks.task import Task


class RLAgent:
    """The policy of a run directory; it acts deterministically.

    Its observations are made as in training: pictures have the same size, and instructions the same
    encoding. From ``info`` it reads the action mask.

    Args:
        path: the run directory, or a model file with its ``config.yaml`` beside it: ``model.npz``
            or, with ``trust``, a file of Stable-Baselines3.
        trust: whether a file of Stable-Baselines3, which can run code, may be loaded.

    Raises:
        UntrustedModel: the file can run code, and ``trust`` is False.
        ValueError: the run does not exist, or its model cannot be read.
    """

    def __init__(self, path: str | Path, trust: bool = False) -> None:
        file = _model_file(Path(path))
        if file.suffix == ".zip" and not trust:
            raise untrusted_model(file)
        config = load_config(file.parent / CONFIG)
        spec = ALGORITHMS[config.algorithm.name]
        self._model = _loaded(file, file.stat().st_mtime_ns, trust)
        self._masks = not spec.needs_mask
        self._policy_observation = PolicyObservation(config.env, spec.needs_mask)
        self.obs_mode: str = config.env.obs_mode

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._instruction: str | None = task.instruction

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The policy's best action."""
        if self._instruction is not None:
            seen = self._policy_observation.reset(obs, info, self._instruction)
            self._instruction = None
        else:
            seen = self._policy_observation.observe(obs, info)
        masks = {"action_masks": info["action_mask"]} if self._masks else {}
        action, _ = self._model.predict(seen, deterministic=True, **masks)
        return Decision(ACTIONS[int(action)])


def _model_file(path: Path) -> Path:
    for file in (path, path / MODEL, path / SB3_MODEL):
        if file.is_file() and (file.name == MODEL or file.suffix == ".zip"):
            return file
    raise ValueError(
        f"there is no trained model {path / MODEL}; give rl: and a directory that er-gym train-rl "
        "has made"
    )


@lru_cache(maxsize=4)
def _loaded(file: Path, changed: int, trust: bool) -> Any:
    """Load the model of a file; the cache serves many episodes while the file is unchanged."""
    torch.set_num_threads(1)  # observations come one at a time, and several workers may run
    return load_model(file, trust, learns=False)
