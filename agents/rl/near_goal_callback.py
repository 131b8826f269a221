"""The trainer's part of the curriculum of :mod:`agents.rl.near_goal`: it moves the positions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from agents.rl.guidance import NearGoal
from agents.rl.model_file import KEPT

_NAME = "near_goal"


class NearGoalCurriculum(BaseCallback):
    """Moves where episodes start, between rollouts, by the success of those that started there.

    Args:
        settings: the rule.
    """

    def __init__(self, settings: NearGoal) -> None:
        super().__init__()
        self._settings = settings
        self.positions = dict.fromkeys(settings.types, settings.first)
        self._results: dict[str, list[bool]] = {name: [] for name in settings.types}

    def begin(self, env: VecEnv, model: BaseAlgorithm | None) -> None:
        """Tell the environments; a continued run's learner has the positions of its checkpoint."""
        kept = getattr(model, KEPT, {}).get(_NAME, {})
        self.positions |= {name: int(kept[name][0]) for name in self.positions if name in kept}
        self._results |= {name: list(kept[name][1]) for name in self.positions if name in kept}
        env.env_method("set_positions", self.positions)

    def note(self, info: Mapping[str, Any]) -> None:
        """Take in what an environment told of a step, the last of an episode or not."""
        name, position = info.get("task_type"), info.get("started_at")
        # Episodes that began at an earlier position say nothing of this one.
        if position and name in self.positions and position == self.positions[name]:
            self._results[name].append(bool(info["is_success"]))

    def move(self) -> bool:
        """Move each position by what was noted; whether any moved."""
        before = dict(self.positions)
        for name, results in self._results.items():
            del results[: -self._settings.over]
            self.positions[name] = self._settings.moved(before[name], tuple(results))
            if self.positions[name] != before[name]:
                results.clear()
        return self.positions != before

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            self.note(info)
        return True

    def _on_rollout_end(self) -> None:
        for name, results in self._results.items():
            self.logger.record(f"{_NAME}/key_actions_left/{name}", self.positions[name])
            if results:
                last = results[-self._settings.over :]
                self.logger.record(f"{_NAME}/success/{name}", sum(last) / len(last))
        if self.move():
            self.training_env.env_method("set_positions", self.positions)
        found = {name: [self.positions[name], list(self._results[name])] for name in self.positions}
        setattr(self.model, KEPT, {**getattr(self.model, KEPT, {}), _NAME: found})
