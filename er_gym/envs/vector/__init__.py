"""Many environments in one process, as one Gymnasium vector environment."""

from er_gym.envs.vector.env import EmbodiedVectorEnv

__all__ = ["EmbodiedVectorEnv"]
