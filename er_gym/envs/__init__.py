"""The Gymnasium interface: :class:`~er_gym.envs.embodied_env.EmbodiedEnv` and its parts."""
