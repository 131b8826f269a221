"""The protocol that every writer of thoughts follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

from agents.vlm.chat import Picture
from er_gym.data.knowledge import Knowledge
from er_gym.data.trajectory import ThoughtKind, ThoughtRecord
from er_gym.rollout.agent import ModelReply


@dataclass(frozen=True)
class ThoughtRequest:
    """The thoughts that are to be written for one turn.

    Attributes:
        knowledge: what the agent knows and decides. A writer may use nothing else.
        kinds: the kinds of the thoughts, in order; not empty.
        limits: the most words of each thought (in Chinese, two characters count as a word).
        pictures: what the agent is shown at this turn; may be empty.
        seed: of the writer's choices; differs between turns.
    """

    knowledge: Knowledge
    kinds: tuple[ThoughtKind, ...]
    limits: tuple[int, ...]
    pictures: tuple[Picture, ...] = ()
    seed: int = 0


@dataclass(frozen=True)
class WrittenThoughts:
    """The thoughts of one turn.

    Attributes:
        thoughts: one for each kind that was asked for, in that order.
        replies: what the model's replies cost, those that the critic refused included.
    """

    thoughts: tuple[ThoughtRecord, ...]
    replies: Sequence[ModelReply] = field(default_factory=tuple)


class ThoughtWriter(Protocol):
    """Writes thoughts. One writer may serve several episodes at once.

    Attributes:
        name: as :class:`~er_gym.data.trajectory.ThoughtRecord` names it.
    """

    name: str

    def write(self, request: ThoughtRequest) -> WrittenThoughts:
        """Write the thoughts of a turn.

        Raises:
            ModelError: the model gives no reply for this episode (model writers only).
            CannotGoOn: no later request can succeed either (model writers only).
        """
