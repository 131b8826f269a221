"""verifiers: a taskset of household tasks, and the environment in which a model plays one.

verifiers finds a taskset by the name of a module. Make one of two lines, ``er_gym_house.py``::

    from er_gym.integrations.verifiers import HouseholdEnv, HouseholdTaskset
    __all__ = ["HouseholdEnv", "HouseholdTaskset"]

and it is ``--env.taskset.id er-gym-house``. The simulator runs in the process of the evaluation,
and its answers are the user's turns.
"""

from __future__ import annotations

import asyncio
import base64
from collections.abc import Iterator
from typing import Any

import verifiers.v1 as vf

from er_gym.integrations.scaffold import DEFAULT
from er_gym.integrations.session import PROMPT, Session, Turn, action_in, png
from er_gym.tasks.suites import load_suite

FORM = "Write the action between <action> and </action>."


class HouseholdData(vf.TaskData):
    """A task: its id in the suite is ``id``."""


class HouseholdConfig(vf.TasksetConfig):
    """What to play.

    Attributes:
        suite: the suite of the tasks.
        prompt: the system message.
        scaffold: what the text tells and what is rewarded.
        pictures: whether the model is shown what the agent sees.
        settings: further arguments of :class:`~er_gym.integrations.session.Session`.
    """

    suite: str = "mini"
    prompt: str = f"{PROMPT} {FORM}"
    scaffold: str = DEFAULT
    pictures: bool = False
    settings: dict[str, Any] = {}  # noqa: RUF012  (pydantic copies it)


class HouseholdTask(vf.Task[HouseholdData]):
    """A household task; the environment records its rewards."""

    @property
    def key(self) -> str:
        """The task's id, which no other task of the suite has."""
        return str(self.data.id)


class HouseholdTaskset(vf.Taskset[HouseholdTask, HouseholdConfig]):
    """The tasks of a suite."""

    def load(self) -> Iterator[HouseholdTask]:
        """The tasks, in the order of the suite."""
        for task in load_suite(self.config.suite).tasks:
            data = HouseholdData(
                id=task.id, name=task.id, prompt=None, system_prompt=self.config.prompt
            )
            yield HouseholdTask(data, self.config.task)


class HouseholdEnvConfig(vf.EnvConfig):
    """Who plays: a model that only talks, with no program of its own."""

    player: vf.AgentConfig = vf.AgentConfig(
        harness=vf.HarnessConfig(id="null"), runtime=vf.SubprocessConfig()
    )


class HouseholdEnv(vf.Env[HouseholdEnvConfig]):
    """Plays one task as one conversation."""

    async def run(self, task: HouseholdTask, agents: Any) -> None:
        """Let the player act until the episode is over, and record its rewards."""
        config = self.config.taskset
        session = Session(
            config.suite, scaffold=config.scaffold, pictures=config.pictures, **config.settings
        )
        earned = 0.0
        try:
            turn = await asyncio.to_thread(session.reset, task.data.id)
            async with agents.player.interaction(task) as interaction:
                said = await interaction.turn(_message(turn))
                while not said.terminated:
                    turn = await asyncio.to_thread(session.step, action_in(said.last_reply))
                    earned += turn.reward
                    if turn.done:
                        break
                    said = await interaction.turn(_message(turn))
        finally:
            await asyncio.to_thread(session.close)
        trace = interaction.trace
        trace.record_reward("episode_reward", earned)
        trace.record_metric("success", float(turn.success))
        trace.record_metric("progress", turn.progress)
        trace.record_metric("steps", float(turn.steps))


def _message(turn: Turn) -> str | list[dict[str, Any]]:
    """The observation as the user's turn."""
    if turn.picture is None:
        return turn.text
    url = "data:image/png;base64," + base64.b64encode(png(turn.picture)).decode()
    picture = {"type": "image_url", "image_url": {"url": url}}
    return [{"role": "user", "content": [picture, {"type": "text", "text": turn.text}]}]
