"""The part of a suite's configuration that says which tasks to generate."""

from __future__ import annotations

import math
from collections.abc import Sequence

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from er_gym.houses.names import is_house
from er_gym.tasks.difficulty import Difficulty
from er_gym.tasks.splits import SCENES
from er_gym.tasks.types import canonical_names
from er_gym.tasks.wordings.instructions import Language
from er_gym.thor import SCENE_NAMES

Span = tuple[float, float | None]
"""The smallest and the largest allowed value, both included; None for no upper bound."""


class SuiteSpec(BaseModel):
    """Which tasks a suite has.

    Attributes:
        total: the number of tasks.
        scenes: the name of a set of scenes (:data:`~er_gym.tasks.splits.SCENES`), or scene names.
        types: names of task types; all types if it is empty.
        layouts: the number of arrangements of each scene, besides the recorded one.
        recorded: whether tasks begin in the recorded arrangement, too.
        per_layout: the number of candidates of each type from each arrangement.
        unseen_objects: whether tasks may be about the types that training is not about
            (:data:`~er_gym.tasks.splits.UNSEEN_TYPES`).
        unseen_wordings: whether half of the tasks of each type are told in wordings that training
            does not see (:func:`~er_gym.tasks.wordings.instructions.half_unseen`).
        language: the language of the instructions.
        left_out: further scenes, whose tasks are made and chosen with the others and dropped then:
            so a suite that gives a room up keeps its other tasks.
        hidden_depth, distractors, distance: the allowed difficulty
            (:class:`~er_gym.tasks.difficulty.Difficulty`; distance in metres).
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    total: int = Field(gt=0)
    scenes: str | tuple[str, ...] = "all"
    types: tuple[str, ...] = ()
    layouts: int = Field(0, ge=0, le=10_000)
    recorded: bool = True
    per_layout: int = Field(3, gt=0)
    unseen_objects: bool = True
    unseen_wordings: bool = False
    language: Language = "en"
    left_out: tuple[str, ...] = ()
    hidden_depth: Span = (0, None)
    distractors: Span = (0, None)
    distance: Span = (0, None)

    @field_validator("scenes")
    @classmethod
    def _known_scenes(cls, scenes: str | tuple[str, ...]) -> str | tuple[str, ...]:
        names = () if isinstance(scenes, str) and scenes in SCENES else scenes
        names = (names,) if isinstance(names, str) else names
        unknown = [name for name in names if name not in SCENE_NAMES and not is_house(name)]
        if unknown or not scenes:
            raise ValueError(
                f"unknown scene {''.join(unknown[:1])!r}; "
                f"give names such as FloorPlan1 or House3-17, or one of: {', '.join(SCENES)}"
            )
        return scenes

    @field_validator("left_out")
    @classmethod
    def _known_left_out(cls, scenes: tuple[str, ...]) -> tuple[str, ...]:
        unknown = [name for name in scenes if name not in SCENE_NAMES]
        if unknown:
            raise ValueError(f"unknown scene {unknown[0]!r}; give names such as FloorPlan1")
        return scenes

    @field_validator("types")
    @classmethod
    def _known_types(cls, types: tuple[str, ...]) -> tuple[str, ...]:
        return canonical_names(types)

    @field_validator("hidden_depth", "distractors", "distance")
    @classmethod
    def _ordered(cls, span: Span) -> Span:
        low, high = span
        if not (math.isfinite(low) and (high is None or low <= high < math.inf)):
            raise ValueError(f"not a range: from {low:g} to {high}; give the smaller number first")
        return span

    @model_validator(mode="after")
    def _some_arrangement(self) -> SuiteSpec:
        if not (self.recorded or self.layouts):
            raise ValueError("recorded is false, so give at least one of layouts")
        return self

    @property
    def rooms(self) -> Sequence[str]:
        """The names of the scenes in which tasks are made, each once; of those left out, too."""
        if isinstance(self.scenes, str):
            rooms = SCENES.get(self.scenes, (self.scenes,))
        else:
            rooms = tuple(dict.fromkeys(self.scenes))
        if self.left_out:
            return tuple(name for name in SCENE_NAMES if name in (*rooms, *self.left_out))
        return rooms

    @property
    def allows_any_difficulty(self) -> bool:
        """Whether the difficulty is not limited."""
        return self.hidden_depth == self.distractors == self.distance == (0, None)

    def admits(self, difficulty: Difficulty) -> bool:
        """Whether a task of this difficulty is allowed."""
        return all(
            low <= value <= (math.inf if high is None else high)
            for value, (low, high) in (
                (difficulty.hidden_depth, self.hidden_depth),
                (difficulty.distractors, self.distractors),
                (difficulty.distance, self.distance),
            )
        )
