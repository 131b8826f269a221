"""Which earlier turns of a conversation are sent: all, or fewer if it is over a limit.

First the oldest pictures are left out, then the texts of the oldest turns. The task, the last
message and the model's actions stay. The order and roles of the messages stay, too, so that every
chat template accepts the rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from agents.vlm.chat import CUT_SHORT, LEFT_OUT, Message, Part, Picture, pictures_of
from er_gym.rollout.causes import PICTURES

_PART = 4
"""One of this many earlier pictures or turns is left out at a time, or one."""


@dataclass(frozen=True)
class Limits:
    """How much of the earlier turns is sent.

    Attributes:
        pictures: the most pictures; None for no limit. Those of the last message are always sent.
        shortened: how many messages after the task, the oldest first, are sent without their texts.
    """

    pictures: int | None = None
    shortened: int = 0

    def tighter(self, messages: Sequence[Message], cause: str) -> Limits | None:
        """Lower limits, for a conversation that is refused within these.

        Args:
            messages: the whole conversation.
            cause: why it is refused: ``pictures`` for too many of them.

        Returns:
            None if there is nothing left to leave out.
        """
        last, shown = pictures_in(messages[-1:]), pictures_in(messages)
        if self.pictures is not None:
            shown = min(shown, self.pictures)
        if (earlier := shown - last) > 0:
            return replace(self, pictures=shown - -(-earlier // _PART))
        left = len(_shortenable(messages)) - self.shortened
        if cause == PICTURES or left <= 0:
            return None
        return replace(self, shortened=self.shortened + min(left, max(2, -(-left // _PART))))

    def applied(self, messages: Sequence[Message], actions: Mapping[int, str]) -> list[Message]:
        """The messages to send.

        Args:
            messages: the whole conversation.
            actions: by the index of a reply, the words that stand for it without its thoughts.
        """
        sent = list(messages)
        if self.pictures is not None:
            sent = with_last_pictures(sent, self.pictures - pictures_in(sent[-1:]))
        for place in _shortenable(messages)[: self.shortened]:
            short = actions.get(place) or CUT_SHORT
            sent[place] = replace(sent[place], parts=(short,), reasoning="")
        return sent


def pictures_in(messages: Sequence[Message]) -> int:
    """How many pictures messages have."""
    return len(pictures_of(messages))


def _shortenable(messages: Sequence[Message]) -> range:
    """The indices of the messages between the task and the last message."""
    task = next((place for place, each in enumerate(messages) if each.role == "user"), 0)
    return range(task + 1, len(messages) - 1)


def with_last_pictures(messages: Sequence[Message], keep: int) -> list[Message]:
    """The messages with the pictures of the last message and the ``keep`` pictures before it."""
    *before, last = messages
    left = pictures_in(before) - max(0, keep)
    shown = []
    for message in before:
        parts: list[Part] = []
        for part in message.parts:
            gone = isinstance(part, Picture) and left > 0
            left -= gone
            parts.append(LEFT_OUT if gone else part)
        shown.append(replace(message, parts=tuple(parts)))
    return [*shown, last]
