"""VAGEN: a household task behind the methods of its ``GymImageEnv``.

VAGEN looks an environment up by the path of its class, in ``vagen/configs/env_registry.yaml``::

    env_registry:
      ErGym: er_gym.integrations.vagen.HouseholdEnv

It asks for no base class, so this file imports nothing of VAGEN.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

from PIL import Image

from er_gym.integrations.session import PROMPT, Session, Turn, action_in

PLACE = "<image>"
"""The place of a picture in VAGEN's texts."""
_FORM = "Write the action between <action> and </action>."


class HouseholdEnv:
    """One episode after another.

    Args:
        env_config: the arguments of :class:`~er_gym.integrations.session.Session`; ``pictures`` is
            True unless it says otherwise. ``prompt``: what the model is told at first.
    """

    def __init__(self, env_config: Mapping[str, Any] | None = None) -> None:
        given = {"pictures": True, **(env_config or {})}
        self._prompt = given.pop("prompt", f"{PROMPT} {_FORM}")
        self._session = Session(**given)

    async def system_prompt(self) -> dict[str, Any]:
        """What the model is told before the first observation."""
        return {"obs_str": self._prompt}

    async def reset(
        self, seed: int, task_id: str | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode, of the task that the seed draws."""
        turn = await asyncio.to_thread(self._session.reset, task_id, seed=seed)
        return _observation(turn), _info(turn)

    async def step(self, action_str: str) -> tuple[dict[str, Any], float, bool, dict[str, Any]]:
        """Do the action in a reply (:func:`~er_gym.integrations.session.action_in`)."""
        turn = await asyncio.to_thread(self._session.step, action_in(action_str))
        return _observation(turn), turn.reward, turn.done, _info(turn)

    async def close(self) -> None:
        """Stop the simulator."""
        await asyncio.to_thread(self._session.close)


def _observation(turn: Turn) -> dict[str, Any]:
    if turn.picture is None:
        return {"obs_str": turn.text}
    return {
        "obs_str": f"{PLACE}\n{turn.text}",
        "multi_modal_input": {PLACE: [Image.fromarray(turn.picture)]},
    }


def _info(turn: Turn) -> dict[str, Any]:
    """``truncated`` tells VAGEN to bootstrap from the value of the last state."""
    return {
        "success": turn.success,
        "truncated": turn.truncated,
        "is_action_valid": turn.is_action_valid,
        "anchor_id": turn.anchor,
        "task_id": turn.task_id,
        "progress": turn.progress,
    }
