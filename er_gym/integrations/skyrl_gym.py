"""SkyRL-gym: a household task as a text environment of several turns.

``register()`` makes it known by :data:`NAME`, which the column ``env_class`` of a data set names;
``rows`` makes such a data set.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from typing import Any

import skyrl_gym
from skyrl_gym.envs.base_text_env import BaseTextEnv, BaseTextEnvStepOutput, ConversationType

from er_gym.integrations.session import PROMPT, Session, Turn, action_in, png
from er_gym.tasks.task import Task

NAME = "er-gym"


class HouseholdEnv(BaseTextEnv):
    """One episode. SkyRL makes one for each trajectory.

    Args:
        env_config: of ``environment.skyrl_gym.er-gym`` in SkyRL's configuration: the arguments of
            :class:`~er_gym.integrations.session.Session`, such as ``scaffold`` and ``pictures``.
        extras: the row's other columns: ``task_id``, a task of the session's source; without it
            one is drawn. SkyRL adds ``max_turns``, at which the episode ends as well.
    """

    def __init__(
        self, env_config: Mapping[str, Any] | None = None, extras: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__()
        extras = extras or {}
        self._task_id = extras.get("task_id")
        self._most = extras.get("max_turns")
        self._session = Session(**dict(env_config or {}))

    def init(self, prompt: ConversationType) -> tuple[ConversationType, dict[str, Any]]:
        """Begin the episode: the prompt, and the first observation after it."""
        self._turn = self._session.reset(self._task_id)
        self._reward = 0.0
        return [*prompt, _message(self._turn)], {"task_id": self._turn.task_id}

    def step(self, action: str) -> BaseTextEnvStepOutput:
        """Do the action in a reply (:func:`~er_gym.integrations.session.action_in`)."""
        self.turns += 1
        turn = self._turn = self._session.step(action_in(action))
        self._reward += turn.reward
        done = turn.done or (self._most is not None and self.turns >= self._most)
        return BaseTextEnvStepOutput(
            observations=[] if done else [_message(turn)],
            reward=turn.reward,
            done=done,
            metadata={"text": turn.text, "success": turn.success, "end_reason": turn.end_reason},
        )

    def get_metrics(self) -> dict[str, Any]:
        """Numbers of the episode, which SkyRL averages."""
        turn = self._turn
        return {
            "success": float(turn.success),
            "progress": turn.progress,
            "episode_reward": self._reward,
            "steps": turn.steps,
        }

    def close(self) -> None:
        """Stop the simulator."""
        self._session.close()


def register(name: str = NAME) -> None:
    """Make the environment known to ``skyrl_gym.make``, once in each process."""
    if name not in skyrl_gym.envs.registration.registry:
        skyrl_gym.register(name, entry_point=f"{__name__}:{HouseholdEnv.__name__}")


def rows(tasks: Iterable[Task], prompt: str = PROMPT, name: str = NAME) -> list[dict[str, Any]]:
    """The rows of a data set for SkyRL, a task each."""
    system = {"role": "system", "content": prompt}
    return [{"prompt": [system], "env_class": name, "task_id": task.id} for task in tasks]


def _message(turn: Turn) -> dict[str, Any]:
    """The observation as a message of the user, its picture as a data URL."""
    if turn.picture is None:
        return {"role": "user", "content": turn.text}
    url = "data:image/png;base64," + base64.b64encode(png(turn.picture)).decode()
    picture = {"type": "image_url", "image_url": {"url": url}}
    return {"role": "user", "content": [picture, {"type": "text", "text": turn.text}]}
