"""One Gymnasium id for each row of the table of task types."""

from __future__ import annotations

import gymnasium

from er_gym.tasks.types import TASK_TYPES


def register_all() -> None:
    """Register every environment id; again is harmless."""
    for task_type in TASK_TYPES:
        if task_type.env_id not in gymnasium.registry:
            gymnasium.register(
                id=task_type.env_id,
                entry_point="er_gym.envs.embodied_env:EmbodiedEnv",
                kwargs={"task_type": task_type.name},
            )
