"""A turn of a trajectory, as the search for odd thoughts looks at it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from er_gym.data.knowledge import Knowledge, knowledge_at
from er_gym.data.mentions import find_mentions
from er_gym.data.phrases import MARK
from er_gym.data.trajectory import Language, Trajectory, Turn
from er_gym.data.words import sentences


@dataclass(frozen=True)
class Moment:
    """A turn of a trajectory.

    Attributes:
        trajectory, index: which one.
    """

    trajectory: Trajectory
    index: int

    @property
    def turn(self) -> Turn:
        """The turn."""
        return self.trajectory.turns[self.index]

    @property
    def language(self) -> Language:
        """Of the thoughts."""
        return self.trajectory.language

    @cached_property
    def known(self) -> Knowledge:
        """What the agent knows."""
        whole = self.trajectory
        return knowledge_at(
            whole.turns, self.index, instruction=whole.instruction, language=whole.language
        )

    @property
    def texts(self) -> list[str]:
        """The thoughts."""
        return [thought.text for thought in self.turn.thoughts]

    def found(self, phrases: Mapping[Language, re.Pattern[str]]) -> Iterator[str]:
        """The sentences of the thoughts in which a phrase of the language occurs."""
        for text in self.texts:
            for sentence in sentences(text):
                if phrases[self.language].search(sentence.lower().replace("’", "'")):
                    yield sentence


def masked(text: str) -> str:
    """A text in lower case with a mark for each name of an object."""
    for mention in reversed(find_mentions(text)):
        text = text[: mention.start] + MARK + text[mention.end :]
    return text.lower().replace("’", "'")
