"""One Gymnasium id for each row of the table of task types, whoever adds it."""

from __future__ import annotations

import gymnasium

from er_gym.tasks.types import TaskType, listen, load_added


def register_all() -> None:
    """Register every environment id, and those of types that are added later.

    Raises:
        PluginError: a type of another package cannot be loaded or used.
    """
    listen(_register)
    load_added()


def _register(task_type: TaskType) -> None:
    if task_type.env_id not in gymnasium.registry:
        gymnasium.register(
            id=task_type.env_id,
            entry_point="er_gym.envs.embodied_env:EmbodiedEnv",
            vector_entry_point="er_gym.envs.vector:EmbodiedVectorEnv",
            kwargs={"task_type": task_type.name},
        )
