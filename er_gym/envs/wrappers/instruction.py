"""The instruction as part of the observation, for agents that do not read."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from er_gym.envs.wrappers.base import TaskWrapper, info_entry
from er_gym.envs.wrappers.encoders import HASHED, make_encoder

KEY = "instruction"


class InstructionEmbedding(TaskWrapper, RecordConstructorArgs):
    """Adds ``"instruction"`` to the observation: the instruction of the task, as a vector.

    ``(E,)`` float32 in [-1, 1], of length 1 (zeros for an instruction without words), the same
    from ``reset`` to the end of the episode. E is the encoder's ``dimension``: 64 for ``"hashed"``.
    An agent that has only the text gets the same vector from
    :func:`~er_gym.envs.wrappers.make_encoder`.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], encoder: str = HASHED) -> None:
        """Wrap an environment.

        Args:
            env: one of er-gym's, wrapped or not.
            encoder: a name for :func:`~er_gym.envs.wrappers.make_encoder`. A model is loaded here,
                once in a process, since the space needs its dimension.

        Raises:
            ValueError: the encoder's name is unknown or its model cannot be loaded; or the
                observation space is not a ``Dict``, or has an ``"instruction"`` already.
            ImportError: what the encoder needs is not installed.
        """
        RecordConstructorArgs.__init__(self, encoder=encoder)
        TaskWrapper.__init__(self, env)
        space = env.observation_space
        if not isinstance(space, spaces.Dict) or KEY in space.spaces:
            raise ValueError(
                f"cannot add {KEY!r} to observations that are a {_kind(space)}; wrap an "
                "environment, once, whose observation space is a Dict, as those of er-gym are"
            )
        # The name instead of the encoder: it pickles short, and a process loads a model only once.
        self._encoder = encoder
        shape = (make_encoder(encoder).dimension,)
        self._embedding = np.zeros(shape, dtype=np.float32)
        self.observation_space = spaces.Dict(
            {**space.spaces, KEY: spaces.Box(-1.0, 1.0, shape, np.float32)}
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode, and encode its instruction."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._embedding = make_encoder(self._encoder)(info_entry(info, "instruction"))
        return self._with_instruction(obs), info

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Do an action, as the environment does."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        return self._with_instruction(obs), float(reward), terminated, truncated, info

    def _with_instruction(self, obs: dict[str, Any]) -> dict[str, Any]:
        # A copy, so that writing into one observation does not change the next.
        return {**obs, KEY: self._embedding.copy()}


def _kind(space: spaces.Space[Any]) -> str:
    if isinstance(space, spaces.Dict):
        return f"Dict of {', '.join(map(str, space.spaces))}"
    return type(space).__name__
