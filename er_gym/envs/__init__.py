"""The Gymnasium face: :class:`~er_gym.envs.embodied_env.EmbodiedEnv` and its parts."""
