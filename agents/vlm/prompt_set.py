"""The interface of a set of prompts, and how pictures are placed in its texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeAlias

from agents.vlm.chat import Part, Picture
from er_gym.data.scene_text import Perceived

Decide: TypeAlias = Literal["tags", "tools", "json"]
Sees: TypeAlias = Literal["pictures", "text"]

THOUGHTS = ("Observation", "Planning", "Thinking", "Reflection", "Verification")
"""The kinds of thought that the paper's models write, each between tags with its name."""
IMAGE = "<image>"
"""Marks the place of a picture in templates and training files."""
IMAGE_MARK = "\ufdd0"
"""Marks the place of a picture in rendered text. It is a Unicode noncharacter, which no text
contains; an ``<image>`` in a task's instruction therefore stays text."""


@dataclass(frozen=True, kw_only=True)
class TurnContext:
    """The episode at a turn.

    Attributes:
        task: the task's instruction.
        decide, sees: see :class:`~agents.vlm.settings.AgentSettings`.
        scene_text: the environment's ``text`` observation without the task, for ``sees="text"``.
        now: what the agent perceives, and ``before``: what it perceived before its last action;
            for dialects without pictures.
        steps: how many steps were taken so far; ``max_steps``: the episode's step limit, 0 if
            unknown.
    """

    task: str
    decide: Decide
    sees: Sees
    scene_text: str = ""
    now: Perceived | None = None
    before: Perceived | None = None
    steps: int = 1
    max_steps: int = 0


@dataclass(frozen=True, kw_only=True)
class LastAction:
    """The last action and its result.

    Attributes:
        action: such as ``navigate to Fridge``.
        success, feedback: the environment's answer.
        pictures: the number of pictures that show the result; ``directions``: of each of them.
    """

    action: str
    success: bool = True
    feedback: str = ""
    pictures: int = 0
    directions: tuple[str, ...] = ()


class PromptSet(Protocol):
    """The texts of one kind of conversation. A text holds an :data:`IMAGE_MARK` for each picture.

    Attributes:
        name: such as ``default/en``.
        digest: sha256, in hex, of everything that the texts are made from.
        about: one line for people that says where the texts come from.
        after_observe: the number of pictures that the model expects after ``observe``: 1 for the
            view ahead; 3 for right, behind and left; 4 for these and the view ahead. None for all
            that there are.
        as_recorded: whether the messages are those of recorded trajectories: an unchanged view is
            not shown again.
    """

    @property
    def name(self) -> str: ...
    @property
    def digest(self) -> str: ...
    @property
    def about(self) -> str: ...
    @property
    def after_observe(self) -> int | None: ...
    @property
    def as_recorded(self) -> bool: ...

    def check(self, *, decide: Decide, sees: Sees) -> None:
        """Raise ValueError if these settings do not fit the prompts."""

    def system(self, *, decide: Decide, sees: Sees, task: str = "") -> str:
        """The system message: the model's role and the format of its replies; "" for no message.

        Args:
            decide, sees: see :class:`~agents.vlm.settings.AgentSettings`.
            task: the task's instruction.
        """

    def first(self, turn: TurnContext) -> str:
        """The first user message: the task and the first observation, as a picture or as text."""

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """The user message after an action."""

    def feedback(self, *, problem: str, decide: Decide, action: str = "") -> str:
        """The user message after a reply without a usable action; it has no picture.

        Args:
            problem: what is wrong with the reply.
            decide: see :class:`~agents.vlm.settings.AgentSettings`.
            action: what the reply names in place of an action, ``""`` for nothing.
        """


def interleave_pictures(text: str, pictures: Sequence[Picture]) -> tuple[Part, ...]:
    """Split a text at its marks and put the pictures there, in order.

    Raises:
        ValueError: the number of pictures is not the number of marks.
    """
    first, *rest = text.split(IMAGE_MARK)
    if len(rest) != len(pictures):
        raise ValueError(f"the text has {len(rest)} places for {len(pictures)} pictures")
    parts: list[Part] = [first]
    for picture, words in zip(pictures, rest, strict=True):
        parts += (picture, words)
    return tuple(part for part in parts if part)


def without_marks(text: str) -> str:
    """A text without marks, for texts from outside."""
    return text.replace(IMAGE_MARK, "")
