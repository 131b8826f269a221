"""Plays any suite with a policy that has been learnt."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch

from agents.base import Decision
from agents.rl.callbacks import MODEL
from agents.rl.config import load_config
from agents.rl.perception import Perception
from agents.rl.train import CONFIG, FAMILIES, load_last
from er_gym.envs.actions import ACTIONS
from er_gym.tasks.task import Task


class RLAgent:
    """The policy of a run directory, playing what it thinks best (not what it would try).

    It sees what it saw in training: pictures are made as small, the instruction is encoded alike.
    Of ``info`` it reads the action mask.

    Args:
        path: the run directory, or the model in it.

    Raises:
        ValueError: there is no such run, or its model cannot be read.
    """

    def __init__(self, path: str | Path) -> None:
        run = Path(path)
        run = run.parent if run.name == MODEL else run
        file = run / MODEL
        if not file.exists():
            raise ValueError(
                f"there is no trained model {file}; give rl: and a directory that "
                "er-gym train-rl has made"
            )
        config = load_config(run / CONFIG)
        family = FAMILIES[config.algorithm.name]
        self._model = _loaded(run, file.stat().st_mtime_ns)
        self._masks = not family.needs_mask
        self._perception = Perception(config.env, family.needs_mask)
        self.obs_mode: str = config.env.obs_mode

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._instruction: str | None = task.instruction

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """What the policy does."""
        if self._instruction is not None:
            seen = self._perception.begin(obs, info, self._instruction)
            self._instruction = None
        else:
            seen = self._perception.see(obs, info)
        masks = {"action_masks": info["action_mask"]} if self._masks else {}
        action, _ = self._model.predict(seen, deterministic=True, **masks)
        return Decision(ACTIONS[int(action)])


@lru_cache(maxsize=4)
def _loaded(run: Path, changed: int) -> Any:
    """The model of a run, read once for many episodes as long as it does not change."""
    torch.set_num_threads(1)  # one observation at a time; and there may be several workers
    return load_last(run)
