"""MaskablePPO: proximal policy optimisation over the legal actions (sb3-contrib)."""

from __future__ import annotations

from pathlib import Path

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
        n_steps=settings.n_steps,
        batch_size=settings.batch_size,
        n_epochs=settings.n_epochs,
        gamma=settings.gamma,
        gae_lambda=settings.gae_lambda,
        clip_range=settings.clip_range,
        ent_coef=settings.ent_coef,
        vf_coef=settings.vf_coef,
        max_grad_norm=settings.max_grad_norm,
        target_kl=settings.target_kl,
        policy_kwargs=config.network.model_dump(),
        seed=config.seed,
        device="cpu",
    )


def load_sb3(file: Path) -> MaskablePPO:
    """A learner as Stable-Baselines3 saved it, which may run what is in the file."""
    return MaskablePPO.load(file, device="cpu")
