"""What is said to a model and what it says, whoever serves it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, Protocol, TypeAlias

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
"""The part that stands for an earlier picture that is not sent again."""


@dataclass(frozen=True)
class Message:
    """A turn of a conversation.

    Attributes:
        role: whose.
        parts: texts and pictures, in order.
        reasoning: what a reasoning model thought before an ``assistant`` turn, where it is to be
            given back to it; otherwise "".
    """

    role: Role
    parts: tuple[Part, ...]
    reasoning: str = ""


@dataclass(frozen=True)
class Usage:
    """What a reply took, in tokens, as the server counts them.

    Attributes:
        prompt: of the conversation sent; ``cached``: how many of them the server remembered.
        completion: of the reply; ``reasoning``: how many of them were thought and not said.
        estimated: whether the server's count was missing or impossible, so that some of these are
            upper bounds (:mod:`agents.vlm.clients.tokens`).
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
        """Prompt and completion."""
        return self.prompt + self.completion


@dataclass(frozen=True)
class Reply:
    """What a model said.

    Attributes:
        text: its words.
        reasoning: what it thought, where the server tells that apart from its words.
        call: the arguments of the tool call that it made, as JSON text; "" where it made none.
        usage: tokens.
        cost: what was paid for it, US dollars, by the prices that the settings state; 0 where they
            state none.
        finish: why it stopped, in the server's word: ``stop``, ``length``, ``content_filter`` …
        model: which answered, in the server's words.
        seconds: how long it took, with all tries.
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


class ModelError(Exception):
    """A model gave no reply, for good; the episode is over and can be played again."""


class Client(Protocol):
    """Whatever gives the next turn of a conversation. Called from many threads at once."""

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn.

        Args:
            messages: the conversation so far; the last is the user's.
            seed: of the episode: two episodes that say the same may get other replies.

        Raises:
            ModelError: there is none, though others may be had.
            CannotGoOn: no further reply can be had: the key is refused, there is no
                such model, the budget is spent.
        """

    def close(self) -> None:
        """Let go of what it holds."""
