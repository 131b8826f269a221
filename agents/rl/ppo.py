"""The learners of ``algorithm.name: ppo``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from sb3_contrib import MaskablePPO
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv

from agents.rl.anchored import AnchoredPPO
from agents.rl.config import PPO, TrainConfig
from agents.rl.policy import TypePolicy


def make(config: TrainConfig, settings: PPO, env: VecEnv) -> MaskablePPO:
    """Make an untrained learner: proximal policy optimisation over the legal actions."""
    rate, start = settings.learning_rate, config.start
    kind: Callable[..., MaskablePPO] = (
        MaskablePPO if start is None else partial(AnchoredPPO, start=start)
    )
    return kind(
        TypePolicy,
        env,
        learning_rate=LinearSchedule(rate, rate * settings.final_learning_rate, 1.0),
        **settings.model_dump(exclude={"name", "learning_rate", "final_learning_rate"}),
        policy_kwargs=config.network.model_dump(),
        seed=config.seed,
        device="cpu",
    )
