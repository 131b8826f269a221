"""NeMo Gym: a resources server whose sessions are household episodes, for its ``gymnasium_agent``.

The file is the ``entrypoint`` of a server's configuration, which docs/integrations/nemo-gym.md has.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any

from nemo_gym.base_resources_server import BaseResourcesServerConfig
from nemo_gym.openai_utils import NeMoGymResponse
from pydantic import Field
from resources_servers.gymnasium import GymnasiumServer, extract_text

from er_gym.integrations.session import PROMPT, Session, Turn, action_in
from er_gym.tasks.task import Task

AGENT = "er_gym_gymnasium_agent"


class HouseholdConfig(BaseResourcesServerConfig):
    """The server's configuration.

    Attributes:
        session: the arguments of :class:`~er_gym.integrations.session.Session` but ``pictures``.
    """

    session: dict[str, Any] = Field(default_factory=dict)


class HouseholdServer(GymnasiumServer):
    """Plays one episode in each session."""

    config: HouseholdConfig

    async def reset(
        self, metadata: dict[str, Any], session_id: str | None = None
    ) -> tuple[str | None, dict[str, Any]]:
        """Begin an episode: of the row's ``task_id``, or of a task that is drawn."""
        await self.close_session(session_id)
        session = await asyncio.to_thread(lambda: Session(**self.config.session))
        self.session_state[session_id] = session
        turn = await asyncio.to_thread(session.reset, metadata.get("task_id"))
        return turn.text, _info(turn)

    async def step(
        self, action: NeMoGymResponse, metadata: dict[str, Any], session_id: str | None = None
    ) -> tuple[str | None, float, bool, bool, dict[str, Any]]:
        """Do the action in a reply (:func:`~er_gym.integrations.session.action_in`)."""
        session: Session = self.session_state[session_id]
        turn = await asyncio.to_thread(session.step, action_in(extract_text(action)))
        return turn.text, turn.reward, turn.terminated, turn.truncated, _info(turn)

    async def close_session(self, session_id: str | None) -> None:
        """Stop the simulator of a session."""
        session = self.session_state.pop(session_id, None)
        if session is not None:
            await asyncio.to_thread(session.close)


def rows(tasks: Iterable[Task], prompt: str = PROMPT) -> list[dict[str, Any]]:
    """The rows of a data set, a task each; the first observation follows the prompt."""
    system = {"role": "system", "content": prompt}
    agent = {"type": "responses_api_agents", "name": AGENT}
    return [
        {
            "responses_create_params": {"input": [system]},
            "task_id": task.id,
            "agent_ref": agent,
        }
        for task in tasks
    ]


def _info(turn: Turn) -> dict[str, Any]:
    return {
        "task_id": turn.task_id,
        "success": turn.success,
        "progress": turn.progress,
        "is_action_valid": turn.is_action_valid,
    }


if __name__ == "__main__":
    HouseholdServer.run_webserver()
