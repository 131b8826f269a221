"""The file format of a recorded conversation; pictures are stored beside it, by path.

A change that an older reader would misread needs a new ``format``. A record never holds a key: the
settings hold none, and a server's address is stored without user and password.
"""

from __future__ import annotations

import os
from typing import Any, Literal
from urllib.parse import urlsplit, urlunsplit

from pydantic import BaseModel, ConfigDict

from agents.vlm.chat import Reply, Role, Usage
from agents.vlm.redaction import Secrets
from agents.vlm.settings import AgentSettings
from er_gym.rollout.records import By, added


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PictureRecord(_Record):
    """A picture that the model was shown.

    Attributes:
        path: the file, relative to the run directory.
        digest: sha256 of its bytes, in hex.
        width, height: pixels.
    """

    path: str
    digest: str
    width: int
    height: int


class MessageRecord(_Record):
    """A message as it was first sent; later requests may leave out its pictures."""

    role: Role
    parts: list[str | PictureRecord]
    reasoning: str = ""


class ThoughtRecord(_Record):
    """A thought; its kind is Observation, Planning, Thinking, Reflection or Verification."""

    kind: str
    text: str


class TrimmedRecord(_Record):
    """What of the conversation a request left out, since the whole was over a limit of the server.

    Attributes:
        pictures: how many of the oldest pictures.
        messages: of how many messages after the task the words, the oldest first.
        why: what the server said of the whole.
    """

    pictures: int
    messages: int
    why: str


class RoundRecord(_Record):
    """A reply and its result.

    Attributes:
        message: the index of the reply among the conversation's messages.
        thoughts: the thoughts before the decision.
        action: the action as the environment writes it; "" if none could be read.
        name: the model's name for the object; ``matched``: how it was matched with a type:
            ``exact``, ``alias``, ``fuzzy``, ``meaning``.
        rules: the tolerance rules that were needed to read the reply.
        problem: what was wrong with the reply, as the feedback to the model states it.
        feedback, success: the environment's answer.
        seconds, prompt_tokens, completion_tokens, cached_tokens, reasoning_tokens, cost, finish,
        model: see :class:`agents.vlm.chat.Reply`; cost in US dollars.
        estimated: whether the token counts are upper bounds, since the server's counts cannot be
            true.
        kept: whether the reply came from the reply cache; an earlier request paid for it.
        by: who decided in place of the model, so that no model wrote the reply; ``""`` if nobody
            did.
        trimmed: what the request left out, since the whole conversation was over a limit of the
            server; None for nothing.
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
    by: By = added("")
    trimmed: TrimmedRecord | None = added(None)

    @property
    def usage(self) -> Usage:
        """The token counts."""
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
        task_id, scene, instruction: of the task.
        agent: the agent's name, such as ``openai:MODEL``.
        settings: :class:`~agents.vlm.settings.AgentSettings` without secrets in addresses.
        prompts, prompts_digest: the name of the set of prompts, and the sha256 of its templates.
        messages: all messages, from the system message to the last reply.
        rounds: one for each reply.
        prompt_tokens, completion_tokens, cost: sums over all rounds, cached replies included.
        estimated: whether some of these are upper bounds.
        error: the error or the refusal that ended the episode, in one line; "" if none did.
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
    """The settings for a record: no server's address has user, password and query."""
    kept = without_secrets(settings, settings.model_dump(mode="json"))
    given = settings.server.base_url
    kept["server"]["base_url"] = (
        url_without_secrets(given)
        if isinstance(given, str)
        else [url_without_secrets(each) for each in given]
    )
    return kept


def without_secrets(settings: AgentSettings, value: dict[str, Any]) -> dict[str, Any]:
    """A JSON value from which the key that the settings name is removed."""
    key = os.environ.get(settings.server.key_from, "").strip()
    plain: dict[str, Any] = Secrets(key, *settings.server.base_urls).redact_all(value)
    return plain


def url_without_secrets(address: str) -> str:
    """An address without user, password, query and fragment."""
    url = urlsplit(address)
    return urlunsplit((url.scheme, url.netloc.rpartition("@")[2], url.path, "", ""))


def reply_fields(reply: Reply) -> dict[str, Any]:
    """What a round records of its reply, under the names of :class:`RoundRecord`."""
    usage = reply.usage
    return {
        "seconds": reply.seconds,
        "cost": reply.cost,
        "finish": reply.finish,
        "model": reply.model,
        "kept": reply.from_cache,
        "prompt_tokens": usage.prompt,
        "completion_tokens": usage.completion,
        "cached_tokens": usage.cached,
        "reasoning_tokens": usage.reasoning,
        "estimated": usage.estimated,
    }
