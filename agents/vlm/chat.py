"""Messages to a model and its replies, the same for every client."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, Protocol, TypeAlias

from er_gym.rollout.agent import CannotFinish, ModelReply

Role = Literal["system", "user", "assistant"]


@dataclass(frozen=True)
class Picture:
    """An encoded picture.

    Attributes:
        data: the file's bytes.
        media_type: ``image/jpeg`` or ``image/png``.
        width, height: pixels.
    """

    data: bytes = field(repr=False)
    media_type: str
    width: int
    height: int

    @cached_property
    def digest(self) -> str:
        """sha256 of the bytes, in hex."""
        return hashlib.sha256(self.data).hexdigest()


Part: TypeAlias = str | Picture
LEFT_OUT = "[picture no longer shown]"
"""The text that replaces an earlier picture that is not sent again."""
CUT_SHORT = "[words no longer shown]"
"""The text that replaces the words of an earlier turn that is not sent again."""


@dataclass(frozen=True)
class Message:
    """A turn of a conversation.

    Attributes:
        role: who speaks.
        parts: texts and pictures, in order.
        reasoning: the thoughts of a reasoning model before an ``assistant`` turn, if they are sent
            back to the model; otherwise "".
    """

    role: Role
    parts: tuple[Part, ...]
    reasoning: str = ""


def pictures_of(messages: Sequence[Message]) -> list[Picture]:
    """The pictures of messages, in order."""
    return [part for each in messages for part in each.parts if isinstance(part, Picture)]


@dataclass(frozen=True)
class Usage:
    """Token counts of a request and its reply, as the server reports them.

    Attributes:
        prompt: tokens of the messages sent; ``cached``: those found in the server's prefix cache.
        completion: tokens of the reply; ``reasoning``: those spent on thoughts.
        estimated: whether a reported count was missing or impossible; an upper bound replaces such
            a count (:mod:`agents.vlm.clients.tokens`).
    """

    prompt: int = 0
    completion: int = 0
    cached: int = 0
    reasoning: int = 0
    estimated: bool = False

    def __add__(self, other: Usage) -> Usage:
        return Usage(
            self.prompt + other.prompt,
            self.completion + other.completion,
            self.cached + other.cached,
            self.reasoning + other.reasoning,
            self.estimated or other.estimated,
        )

    @property
    def total(self) -> int:
        """Prompt and completion tokens together."""
        return self.prompt + self.completion


@dataclass(frozen=True)
class Reply:
    """A reply of a model.

    Attributes:
        text: the text of the reply.
        reasoning: the thoughts before it, if the server returns them separately.
        call: the arguments of the tool call as JSON text; "" without a tool call.
        usage: token counts.
        cost: US dollars, by the prices of the settings; 0 without prices.
        finish: the finish reason as the server gives it: ``stop``, ``length``, ``content_filter`` …
        refused: whether the text is a refusal, as the server says.
        model: the model's name as the server gives it.
        seconds: how long the request took, all tries included.
        from_cache: whether the reply cache had it; an earlier request paid for it.
    """

    text: str
    reasoning: str = ""
    call: str = ""
    usage: Usage = Usage()
    cost: float = 0.0
    finish: str = "stop"
    model: str = ""
    seconds: float = 0.0
    from_cache: bool = False
    refused: bool = False


def model_reply(reply: Reply) -> ModelReply:
    """What a reply cost, as decisions and trajectories state it."""
    return ModelReply(
        model=reply.model,
        seconds=reply.seconds,
        prompt_tokens=reply.usage.prompt,
        completion_tokens=reply.usage.completion,
        cost=reply.cost,
        cached=reply.from_cache,
    )


def template_message(role: str, parts: Sequence[object]) -> dict[str, Any]:
    """A message as the chat templates of transformers take it; a part that is no text is a
    picture."""
    if all(isinstance(part, str) for part in parts):
        return {"role": role, "content": "\n".join(map(str, parts))}
    blocks = [
        {"type": "text", "text": part} if isinstance(part, str) else {"type": "image"}
        for part in parts
    ]
    return {"role": role, "content": blocks}


class ModelError(Exception):
    """A request failed after all tries. The episode ends; it can be played again."""


class ConversationRefused(ModelError, CannotFinish):
    """This conversation gets no reply, now or later, and others do: it is too long, has too many
    pictures, or its content is refused. ``cause`` says which."""


class Client(Protocol):
    """Asks a model for the next turn of a conversation. Many threads may call it at once."""

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn.

        Args:
            messages: the conversation so far; the last message is the user's.
            seed: of the episode; equal messages in two episodes may get different replies.

        Raises:
            ModelError: this request failed; others may succeed.
            ConversationRefused: this conversation would get no reply later, either.
            CannotGoOn: no later request can succeed: the server refuses the key, the model does
                not exist, or the budget is spent.
        """

    def close(self) -> None:
        """Release connections, files and memory."""
