"""What a set of prompts is, and how pictures find their places in its words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from agents.vlm.chat import Part, Picture

Decide: TypeAlias = Literal["tags", "tools", "json"]
Sees: TypeAlias = Literal["pictures", "text"]

THOUGHTS = ("Observation", "Planning", "Thinking", "Reflection", "Verification")
"""The kinds of thought that the paper's models write, each between tags of its name."""
IMAGE = "<image>"
"""Where a picture goes, in templates and training files."""
IMAGE_MARK = "\ufdd0"
"""The same in rendered text. It is no character, so that nobody writes it: an ``<image>`` in the
words of a task is just that."""


@dataclass(frozen=True, kw_only=True)
class TurnContext:
    """What a turn is about.

    Attributes:
        task: its instruction.
        decide, sees: as :class:`~agents.vlm.settings.AgentSettings` has them.
        scene_text: the environment's observation ``text``, for ``sees="text"``.
        steps: taken so far; ``max_steps``: of the episode, 0 where it is not known.
    """

    task: str
    decide: Decide
    sees: Sees
    scene_text: str = ""
    steps: int = 1
    max_steps: int = 0


@dataclass(frozen=True, kw_only=True)
class LastAction:
    """What was done last.

    Attributes:
        action: such as ``navigate to Fridge``.
        success, feedback: the environment's answer.
        pictures: how many it shows.
    """

    action: str
    success: bool = True
    feedback: str = ""
    pictures: int = 0


class PromptSet(Protocol):
    """The words of one kind of conversation. Texts have a :data:`IMAGE_MARK` for each picture.

    Attributes:
        name: such as ``default/en``.
        digest: sha256, in hex, of all that its words are made from.
        about: where they are from, in a line for people.
        after_observe: how many pictures the model expects after an ``observe``: 1 is what is ahead;
            3 are what is right, behind and left; 4 are these and what is ahead. None for as many as
            there are.
    """

    @property
    def name(self) -> str: ...
    @property
    def digest(self) -> str: ...
    @property
    def about(self) -> str: ...
    @property
    def after_observe(self) -> int | None: ...

    def system(self, *, decide: Decide, sees: Sees) -> str:
        """What the model is and how it replies; "" where there is no such message."""

    def first(self, turn: TurnContext) -> str:
        """The first turn: the task, and what is seen, in one picture or in words."""

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """The turn after an action."""

    def feedback(self, *, problem: str, decide: Decide) -> str:
        """The turn after a reply that names no action that can be taken; without a picture.

        Args:
            problem: what is wrong with it, in words.
        """


def interleave_pictures(text: str, pictures: Sequence[Picture]) -> tuple[Part, ...]:
    """Text with pictures in place of its marks, in order.

    Raises:
        ValueError: there are not as many pictures as marks.
    """
    first, *rest = text.split(IMAGE_MARK)
    if len(rest) != len(pictures):
        raise ValueError(f"the text has {len(rest)} places for {len(pictures)} pictures")
    parts: list[Part] = [first]
    for picture, words in zip(pictures, rest, strict=True):
        parts += (picture, words)
    return tuple(part for part in parts if part)


def without_marks(text: str) -> str:
    """Words of others, in which nothing can be taken for a mark."""
    return text.replace(IMAGE_MARK, "")
