"""An episode as a conversation in a dialect, for models that were tuned on er-gym's training files.

The messages are those of the files (:mod:`er_gym.data.dialects`): what the user says of the room
and of the last action, and the action in the assistant's reply. So a trained model such as
``zoo:er-tiny-text`` can be the start of reinforcement learning.
"""

from __future__ import annotations

from er_gym.data.dialects import ActionResult, load_dialect, system_text, user_turn
from er_gym.data.scene_text import Perceived
from er_gym.data.trajectory import Language
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.integrations.session import action_in
from er_gym.tasks.task import Task

OBS_MODE = "objects"
"""What the environment must observe, for the dialect's words about it."""
_NO_ACTION = "(no action)"


class Conversation:
    """An environment that is spoken with: one episode after another.

    Args:
        env: made with ``obs_mode`` :data:`OBS_MODE`.
        dialect: the name of a dialect without pictures, or its folder.
        language: of its texts.

    Attributes:
        reward: the sum of the episode's rewards.
        success: whether the task is done.
        done: whether the episode is over.

    Raises:
        ValueError: there is no such dialect, it lacks the language, or it shows pictures.
    """

    def __init__(self, env: EmbodiedEnv, dialect: str = "text", language: Language = "en") -> None:
        self._env, self._texts = env, load_dialect(dialect).texts_in(language)
        if self._texts.sees != "text":
            raise ValueError(f"the dialect {dialect!r} shows pictures; choose one without, as text")
        self.reward, self.success, self.done = 0.0, False, True

    def begin(self, task: Task | str) -> list[dict[str, str]]:
        """Begin an episode.

        Args:
            task: the task, or its id in the environment's suite.

        Returns:
            The messages before the model's first reply, with ``role`` and ``content``.
        """
        _, info = self._env.reset(options={"task": task})
        self.reward, self.success, self.done = 0.0, False, False
        self._instruction = info["instruction"]
        self._perceived = Perceived.of(with_details(self._env, info))
        told = user_turn(self._texts, self._instruction, None, (), self._perceived)
        system = system_text(self._texts, self._instruction)
        messages = [{"role": "system", "content": system}] if system else []
        return [*messages, {"role": "user", "content": "".join(told)}]

    def answer(self, reply: str) -> dict[str, str]:
        """Do the action of a reply (:func:`~er_gym.integrations.session.action_in`).

        Returns:
            The user's next message. After the last action of the episode, ``done`` is true, and no
            model needs to read it.
        """
        action = action_in(reply)
        _, reward, terminated, truncated, info = self._env.step(action)
        self.reward += float(reward)
        self.success, self.done = bool(info["success"]), terminated or truncated
        said = info["action"] or action or _NO_ACTION
        last = ActionResult(said, bool(info["action_success"]), info["feedback"])
        before = self._perceived
        now = self._perceived = Perceived.of(with_details(self._env, info), before)
        if not info["verb"]:  # no action: nothing was done, and nothing is told of the room
            told = user_turn(self._texts, "", last, ())
        else:
            told = user_turn(self._texts, self._instruction, last, (), now, before)
        return {"role": "user", "content": "".join(told)}
