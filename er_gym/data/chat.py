"""A trajectory as a conversation: the one form from which all training files are derived.

A dialect (:mod:`er_gym.data.dialects`) makes it of a trajectory; an export
(:mod:`er_gym.data.exports`) writes it down.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, TypeVar

from er_gym.data.trajectory import PictureRecord

Role: TypeAlias = Literal["system", "user", "assistant"]
Part: TypeAlias = str | PictureRecord
Shown = TypeVar("Shown")
"""A picture, or what stands for one."""
IMAGE = "<image>"
"""The place of a picture in formats whose messages are plain texts."""


@dataclass(frozen=True)
class ChatTurn:
    """One message.

    Attributes:
        role: who speaks.
        parts: texts and pictures in order. Only the user shows pictures.
        train: whether an assistant's turn gets loss; False for all others.
    """

    role: Role
    parts: tuple[Part, ...]
    train: bool = False

    @property
    def text(self) -> str:
        """The message as one text, with :data:`IMAGE` for each picture."""
        return "".join(part if isinstance(part, str) else IMAGE for part in self.parts)

    @property
    def pictures(self) -> tuple[PictureRecord, ...]:
        """The pictures of the message, in order."""
        return tuple(part for part in self.parts if not isinstance(part, str))


@dataclass(frozen=True)
class Chat:
    """A conversation: perhaps a system message, then user and assistant in turn, the user first.

    Attributes:
        id: the trajectory's.
        turns: the messages.
        reply_told: how the user's message quotes a reply of the assistant, with ``{reply}``; see
            :func:`told_by_user`.
    """

    id: str
    turns: tuple[ChatTurn, ...]
    reply_told: str = "{reply}"

    @property
    def pictures(self) -> tuple[PictureRecord, ...]:
        """All pictures, in order."""
        return tuple(picture for turn in self.turns for picture in turn.pictures)

    @property
    def train(self) -> tuple[bool, ...]:
        """For each turn of the assistant, whether it is learnt."""
        return tuple(turn.train for turn in self.turns if turn.role == "assistant")

    @property
    def trains_all(self) -> bool:
        """Whether every turn of the assistant is learnt."""
        return all(self.train)


def trained_prefixes(chat: Chat) -> Iterator[Chat]:
    """For each turn with loss, the conversation up to it, in which it alone gets loss."""
    for place, turn in enumerate(chat.turns):
        if turn.train:
            before = (replace(each, train=False) for each in chat.turns[:place])
            yield replace(chat, turns=(*before, turn))


def told_by_user(chat: Chat) -> Chat:
    """The conversation in which the user's messages quote the assistant's turns without loss.

    For formats in which every turn of the assistant gets loss: each turn that gets none becomes
    part of the user's message around it. User and assistant still alternate, no picture is lost,
    and everything after the last turn with loss is left out. Empty if no turn gets loss.
    """
    turns: list[ChatTurn] = []
    kept = 0
    for turn in chat.turns:
        if turn.role == "assistant" and not turn.train:
            words = chat.reply_told.replace("{reply}", turn.text)
            turn = ChatTurn("user", (f"\n{words}\n",))
        if turn.role == "user" and turns and turns[-1].role == "user":
            turns[-1] = ChatTurn("user", joined((*turns[-1].parts, *turn.parts)))
        else:
            turns.append(turn)
        kept = len(turns) if turn.train else kept
    return replace(chat, turns=tuple(turns[:kept]))


def joined(parts: tuple[str | Shown, ...]) -> tuple[str | Shown, ...]:
    """The parts with neighbouring texts joined and empty ones left out."""
    found: list[str | Shown] = []
    for part in parts:
        last = found[-1] if found else None
        if isinstance(part, str) and isinstance(last, str):
            found[-1] = last + part
        elif part != "":
            found.append(part)
    return tuple(found)
