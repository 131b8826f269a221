"""The agent ``human``: it leaves the record that a vision-language agent leaves, without a model.

A person gets the same feedback and the same pictures as such an agent.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from agents.vlm.agent import VLMAgent
from agents.vlm.chat import Message, Reply
from agents.vlm.matching import Matcher
from agents.vlm.prompt_set import IMAGE_MARK, Decide, LastAction, Sees, TurnContext, without_marks
from agents.vlm.settings import AgentSettings

HUMAN = "human"
"""The agent's name in runs that a person plays."""


class PersonPrompts:
    """What the page says, as a :class:`~agents.vlm.prompt_set.PromptSet`: the instruction, then the
    feedback on each action, with the pictures."""

    name = HUMAN
    digest = hashlib.sha256(b"instruction, feedback, pictures").hexdigest()
    about = "the page on which a person plays"
    after_observe = None
    as_recorded = False

    def check(self, *, decide: Decide, sees: Sees) -> None:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""

    def system(self, *, decide: Decide, sees: Sees, task: str = "") -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`; there is none."""
        return ""

    def first(self, turn: TurnContext) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return f"{without_marks(turn.task)}\n{IMAGE_MARK}"

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return f"{without_marks(last_action.feedback)}\n{IMAGE_MARK * last_action.pictures}"

    def feedback(self, *, problem: str, decide: Decide, action: str = "") -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return without_marks(problem)


class _NoModel:
    """Is never asked: a person decides every step."""

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        raise RuntimeError("a person plays; there is no model to ask")

    def close(self) -> None:
        pass


def person_agent(seed: int) -> VLMAgent:
    """The agent of an episode in which a person decides every step."""
    settings = AgentSettings()
    return VLMAgent(_NoModel(), settings, PersonPrompts(), Matcher(settings.matching), seed, HUMAN)
