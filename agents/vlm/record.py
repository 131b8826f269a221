"""What is kept of a conversation: a wire format, pictures by path.

A change that an older reader would misread takes a new ``format``. There is never a key in it: none
is in the settings either, and of a server's address only the part without user and password.
"""

from __future__ import annotations

import os
from typing import Any, Literal
from urllib.parse import urlsplit, urlunsplit

from pydantic import BaseModel, ConfigDict

from agents.vlm.chat import Role, Usage
from agents.vlm.clients.redaction import Secrets
from agents.vlm.settings import AgentSettings


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PictureRecord(_Record):
    """A picture that was shown.

    Attributes:
        path: of the file, from the run directory on.
        digest: sha256 of its bytes, in hex.
        width, height: pixels.
    """

    path: str
    digest: str
    width: int
    height: int


class MessageRecord(_Record):
    """A turn, as it was when it was said: later requests may leave out its pictures."""

    role: Role
    parts: list[str | PictureRecord]
    reasoning: str = ""


class ThoughtRecord(_Record):
    """A thought, and of which kind: Observation, Planning, Thinking, Reflection, Verification."""

    kind: str
    text: str


class RoundRecord(_Record):
    """A reply and what came of it.

    Attributes:
        message: which of the conversation's messages the reply is.
        thoughts: what it says before the decision.
        action: what was done, in the environment's words; "" where no action could be read.
        name: what the model called the object; ``matched`` how that became a type: ``exact``,
            ``alias``, ``fuzzy``, ``meaning``.
        rules: which tolerances were needed to read the reply.
        problem: what was wrong with it, as the model was told.
        feedback, success: the environment's answer.
        seconds, prompt_tokens, completion_tokens, cached_tokens, reasoning_tokens, cost, finish,
        model: see :class:`agents.vlm.chat.Reply`; cost in US dollars.
        estimated: whether the tokens are upper bounds, since the server's count cannot be true.
        kept: whether it was kept from an earlier request, which paid for it.
    """

    message: int
    thoughts: list[ThoughtRecord] = []
    action: str = ""
    name: str = ""
    matched: str = ""
    rules: list[str] = []
    problem: str = ""
    feedback: str = ""
    success: bool = False
    seconds: float = 0.0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    cached_tokens: int = 0
    reasoning_tokens: int = 0
    estimated: bool = False
    cost: float = 0.0
    finish: str = ""
    model: str = ""
    kept: bool = False

    @property
    def usage(self) -> Usage:
        """Its tokens."""
        return Usage(
            self.prompt_tokens,
            self.completion_tokens,
            self.cached_tokens,
            self.reasoning_tokens,
            self.estimated,
        )


class ConversationRecord(_Record):
    """The conversation of one episode.

    Attributes:
        task_id, scene, instruction: the task's.
        agent: its spec, such as ``openai:MODEL``.
        settings: :class:`~agents.vlm.settings.AgentSettings`, less what an address might give away.
        prompts, prompts_digest: the name of the set of prompts, and sha256 of its templates.
        messages: from the system's to the last reply.
        rounds: one for each reply.
        prompt_tokens, completion_tokens, cost: over all rounds, whenever they were paid for.
        estimated: whether some of these are upper bounds.
        error: what the episode crashed with, in one line; "" if it did not.
    """

    format: Literal["er-gym/conversation/1"] = "er-gym/conversation/1"
    task_id: str
    scene: str
    instruction: str
    agent: str
    settings: dict[str, Any]
    prompts: str
    prompts_digest: str
    messages: list[MessageRecord]
    rounds: list[RoundRecord]
    prompt_tokens: int
    completion_tokens: int
    cost: float
    estimated: bool = False
    error: str = ""


def settings_to_record(settings: AgentSettings) -> dict[str, Any]:
    """Settings as they may be kept: a server's address without user, password and query."""
    kept = without_secrets(settings, settings.model_dump(mode="json"))
    kept["server"]["base_url"] = url_without_secrets(settings.server.base_url)
    return kept


def without_secrets(settings: AgentSettings, value: dict[str, Any]) -> dict[str, Any]:
    """A JSON value without the key that the settings name."""
    key = os.environ.get(settings.server.key_from, "").strip()
    plain: dict[str, Any] = Secrets(key, settings.server.base_url).redact_all(value)
    return plain


def url_without_secrets(address: str) -> str:
    """An address without user, password, query and fragment."""
    url = urlsplit(address)
    return urlunsplit((url.scheme, url.netloc.rpartition("@")[2], url.path, "", ""))


def token_counts(usage: Usage) -> dict[str, Any]:
    """The token counts of a round, under the names of :class:`RoundRecord`."""
    return {
        "prompt_tokens": usage.prompt,
        "completion_tokens": usage.completion,
        "cached_tokens": usage.cached,
        "reasoning_tokens": usage.reasoning,
        "estimated": usage.estimated,
    }
