"""Episodes that are played by the texts of actions, as trainers of language models play them."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from er_gym.envs.actions import INDEX, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.feedback_words import SAY
from er_gym.envs.sources import Source
from er_gym.envs.wrappers import KeyActionShaping
from er_gym.integrations.scaffold import DEFAULT, OBSERVATIONS, Scaffold
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

PROMPT = (
    "You are in a room of a house and have a task to do there. Do one action at a time until the "
    "task is done; then do the action 'end'. "
    + SAY(alone=", ".join(verbs.BARE_VERBS), others=", ".join(verbs.OBJECT_VERBS))
)
"""What a model is told before the first observation, unless the trainer has words of its own."""
_TAGGED = re.compile(r"<(action|answer|DecisionMaking)>(.*?)</\1>", re.IGNORECASE | re.DOTALL)
_OVER = "The episode is over ({reason}); nothing more can be done in it."
_CLOSED = "the session is closed: make a new one"


def action_in(reply: str) -> str:
    """The text of the action in a model's reply.

    It is what the last pair of tags ``<action>``, ``<answer>`` or ``<DecisionMaking>`` holds;
    without such tags, what follows the last ``</think>``.
    """
    tagged = _TAGGED.findall(reply)
    said: str = tagged[-1][1] if tagged else reply.rpartition("</think>")[2]
    return said.strip()


def png(picture: NDArray[np.uint8]) -> bytes:
    """A picture, (height, width, 3) uint8, as a PNG file."""
    file = io.BytesIO()
    # Pillow's own level takes 57 ms for 800×450, four times as long as to draw, for a fifth less.
    Image.fromarray(picture).save(file, "PNG", compress_level=1)
    return file.getvalue()


@dataclass(frozen=True, eq=False)
class Turn:
    """What ``reset`` and ``step`` answer.

    Attributes:
        text: the observation in words.
        picture: the agent's view, (height, width, 3) uint8; None in a session without pictures.
        reward: of this step, 0 at ``reset``.
        terminated, truncated: as Gymnasium means them.
        success: whether the task is done; decided at the end, False before.
        is_action_valid: whether the text named an action that was legal.
        anchor: the task and :func:`~er_gym.envs.observations.anchor_of`, the state that GiGPO
            groups steps by.
        progress: the share of the task's key actions that are done; for records, not for agents.
        task_id: the task's id.
        instruction: what the agent is asked to do.
        steps, max_steps: steps taken, of those allowed; placing the agent is the first.
        end_reason: why the episode is over, ``""`` while it is not.
    """

    text: str
    picture: NDArray[np.uint8] | None
    reward: float
    terminated: bool
    truncated: bool
    success: bool
    is_action_valid: bool
    anchor: str
    progress: float
    task_id: str
    instruction: str
    steps: int
    max_steps: int
    end_reason: str

    @property
    def done(self) -> bool:
        """Whether the episode is over."""
        return self.terminated or self.truncated


class Session:
    """Plays one episode after another in an environment of its own.

    Args:
        episode_source: where tasks come from, see :class:`~er_gym.envs.embodied_env.EmbodiedEnv`.
        scaffold: what the text tells and what is rewarded (:mod:`er_gym.integrations.scaffold`).
        pictures: whether turns have the agent's view; None for those whose text needs it.
        gamma: the trainer's discount, for the reward ``shaping``.
        settings: further arguments of ``EmbodiedEnv``: ``task_type``, ``instances``, ``protocol``,
            ``max_steps``, ``width``, ``height`` …

    Raises:
        ValueError: an argument is out of its range.
    """

    def __init__(
        self,
        episode_source: Source = "mini",
        *,
        scaffold: str = DEFAULT,
        pictures: bool | None = None,
        gamma: float = 1.0,
        **settings: Any,
    ) -> None:
        self.scaffold = Scaffold.named(scaffold)
        self._text = OBSERVATIONS[self.scaffold.observation]
        if pictures is None:
            pictures = self.scaffold.observation == "picture"
        kinds = (self._text, "anchor", *(["rgb"] if pictures else []))
        env: gymnasium.Env[Any, Any] = EmbodiedEnv(
            episode_source, obs_mode="+".join(kinds), **settings
        )
        if self.scaffold.reward == "shaping":
            env = KeyActionShaping(env, gamma)
        self._env: gymnasium.Env[Any, Any] | None = env
        self._mask: NDArray[np.int8] | None = None
        self._turn: Turn | None = None

    def reset(
        self, task: Task | str | None = None, *, seed: int | None = None, scene: str | None = None
    ) -> Turn:
        """Begin an episode, of the given task or of one that is drawn.

        Raises:
            ValueError: there is no such task or scene. The episode under way goes on.
            gymnasium.error.Error: the seed is not a whole number of at least 0.
            ResetNeeded: the session is closed.
        """
        pinned = {"task": task, "scene": scene}
        options = {name: value for name, value in pinned.items() if value is not None}
        obs, info = self._open().reset(seed=seed, options=options)
        return self._told(obs, info, 0.0, False, False, valid=True)

    def step(self, action: str) -> Turn:
        """Do the action that a text names.

        A text that names no action, or one that is not possible now, changes nothing in the room;
        the turn says so. After the end of the episode every turn says that it is over.

        Raises:
            ResetNeeded: no episode has begun, or the session is closed.
        """
        env, before = self._open(), self._turn
        if before is not None and before.done:
            over = _OVER.format(reason=before.end_reason)
            self._turn = replace(before, text=over, reward=0.0, is_action_valid=False)
            return self._turn
        # Models write numbers, too, and the environment would take one for an action's index.
        mask = self._mask
        obs, reward, terminated, truncated, info = env.step(str(action))
        index = INDEX.get(Action(info["verb"], info["object_type"]))
        valid = mask is not None and index is not None and bool(mask[index])
        return self._told(obs, info, float(reward), terminated, truncated, valid)

    def close(self) -> None:
        """Stop the simulator; the session cannot be used afterwards."""
        env, self._env = self._env, None
        if env is not None:
            env.close()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _open(self) -> gymnasium.Env[Any, Any]:
        if self._env is None:
            raise ResetNeeded(_CLOSED)
        return self._env

    def _told(
        self,
        obs: Mapping[str, Any],
        info: Mapping[str, Any],
        reward: float,
        terminated: bool,
        truncated: bool,
        valid: bool,
    ) -> Turn:
        self._mask = info["action_mask"]
        if self.scaffold.reward == "success":
            reward = float(info["success"])
        done, left = info["key_actions_done"], info["key_actions_left"]
        self._turn = Turn(
            text=obs[self._text],
            picture=obs.get("rgb"),
            reward=reward,
            terminated=terminated,
            truncated=truncated,
            success=info["success"],
            is_action_valid=valid,
            anchor=f"{info['task_id']}#{info['anchor']}",
            progress=done / max(done + left, 1),
            task_id=info["task_id"],
            instruction=info["instruction"],
            steps=info["steps"],
            max_steps=info["max_steps"],
            end_reason=info["end_reason"],
        )
        return self._turn
