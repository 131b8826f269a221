"""ms-swift: a household task as an environment of its multi-turn ``gym_scheduler``.

``swift rollout`` and ``swift rlhf`` load this file with ``--external_plugins``, and ``--gym_env
er_gym`` chooses it. A row of the data set may say which task: ``rows`` makes such rows.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from swift.rollout.gym_env import Env, envs

from er_gym.integrations.session import PROMPT, Session, action_in
from er_gym.tasks.task import Task

NAME = "er_gym"


class HouseholdEnv(Env):
    """One episode. ms-swift makes one for each trajectory and closes it.

    Args:
        env_config: of the row: ``task_id``, a task of the session's source, without which one is
            drawn; ``prompt``, the system message; and the arguments of
            :class:`~er_gym.integrations.session.Session` but ``pictures``, since ms-swift's
            observations are texts.
    """

    def __init__(self, env_config: Mapping[str, Any]) -> None:
        super().__init__(env_config)
        # The columns of a data set's structs are filled with None.
        given = {name: value for name, value in env_config.items() if value is not None}
        given.pop("name", None)
        self._task_id = given.pop("task_id", None)
        self._prompt = given.pop("prompt", PROMPT)
        self._session = Session(**given)

    async def reset(self, config: Any) -> tuple[str, dict[str, Any], str]:
        """Begin the episode: the observation, what is known of it, and the system message."""
        turn = await asyncio.to_thread(self._session.reset, self._task_id)
        return turn.text, {"task_id": turn.task_id}, self._prompt

    async def step(
        self, action: Sequence[Mapping[str, Any]]
    ) -> tuple[str, float, bool, dict[str, Any]]:
        """Do the action in the last message (:func:`~er_gym.integrations.session.action_in`)."""
        said = action_in(str(action[-1]["content"]))
        turn = await asyncio.to_thread(self._session.step, said)
        about = {"success": turn.success, "end_reason": turn.end_reason}
        return turn.text, turn.reward, turn.done, about

    async def close(self) -> None:
        """Stop the simulator."""
        await asyncio.to_thread(self._session.close)


def rows(tasks: Iterable[Task], **env_config: Any) -> list[dict[str, Any]]:
    """The rows of a data set, a task each; its messages are those of the environment.

    Args:
        tasks: of the session's source.
        env_config: see :class:`HouseholdEnv`.
    """
    message = {"role": "user", "content": "Begin."}
    return [
        {"messages": [message], "env_config": {"name": NAME, "task_id": task.id, **env_config}}
        for task in tasks
    ]


envs[NAME] = HouseholdEnv
