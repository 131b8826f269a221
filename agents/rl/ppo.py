"""MaskablePPO: proximal policy optimisation over the legal actions (sb3-contrib)."""

from __future__ import annotations

from sb3_contrib import MaskablePPO
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv

from agents.rl.config import PPO, TrainConfig
from agents.rl.policy import TypePolicy


def make(config: TrainConfig, settings: PPO, env: VecEnv) -> MaskablePPO:
    """Make an untrained learner."""
    rate = settings.learning_rate
    return MaskablePPO(
        TypePolicy,
        env,
        learning_rate=LinearSchedule(rate, rate * settings.final_learning_rate, 1.0),
        **settings.model_dump(exclude={"name", "learning_rate", "final_learning_rate"}),
        policy_kwargs=config.network.model_dump(),
        seed=config.seed,
        device="cpu",
    )
