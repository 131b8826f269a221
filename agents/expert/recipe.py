"""Recipes: how many trajectories of which parts and task types a collection has."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from agents import configs
from agents.expert.explorer import Strength
from agents.expert.kinds import MODES
from er_gym.tasks.types import BY_NAME

DEFAULT = "paper"
ANOMALY, EXPLORED, CORRECTED = "anomaly", "explored", "corrected"
"""Kinds of trajectories beside the expert's ``a``, ``b`` and ``c``: things go wrong, an explorer
plays, a failed episode is corrected."""
SEARCH = "search"
"""The mode of an explorer's trajectory in which something must have been searched for."""
Share = Annotated[float, Field(ge=0)]


class Part(BaseModel):
    """A part of a collection.

    Attributes:
        actor: who plays: the ``expert``, an ``explorer``, or the ``corrector`` of episodes in which
            explorers fail.
        types: the number of trajectories by task type; with a limit, their shares.
        kinds: the shares of the expert's kinds of trajectories: ``a``, ``b``, ``c``, ``anomaly``.
        explorers: by name, how well explorers play.
        faults: the rates of the faults that the environment injects, by kind.
        direct: the share of an explorer's candidates that are taken even if nothing had to be
            searched for.
        repeats: the share of actions that the expert repeats without need.
        most_actions: longer trajectories are not taken.
        expected: the share of candidates that is expected to be taken. It decides how many are
            looked at in one round, and so the time, but not which are taken.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    actor: Literal["expert", "explorer", "corrector"]
    types: dict[str, int]
    kinds: dict[str, Share] = {}
    explorers: dict[str, Strength] = {}
    direct: float = Field(default=0.0, ge=0, le=1)
    faults: dict[str, float] = {}
    repeats: float = Field(default=0.0, ge=0, le=1)
    most_actions: int = Field(default=36, gt=0)
    expected: float = Field(default=0.5, gt=0, le=1)

    @field_validator("types")
    @classmethod
    def _known_types(cls, types: dict[str, int]) -> dict[str, int]:
        unknown = sorted(types.keys() - BY_NAME.keys())
        if unknown:
            raise ValueError(f"unknown task type {unknown[0]!r}; there are: {', '.join(BY_NAME)}")
        if any(number < 0 for number in types.values()) or not any(types.values()):
            raise ValueError(f"{types} are not numbers from 0, at least one of them above 0")
        return types

    @model_validator(mode="after")
    def _complete(self) -> Part:
        if self.actor == "expert":
            known = (*MODES, ANOMALY)
            unknown = sorted(self.kinds.keys() - set(known))
            if unknown or not any(self.kinds.values()):
                raise ValueError(
                    f"kinds are {self.kinds}; give shares of {', '.join(known)} for the expert"
                )
        elif not any(strength.share for strength in self.explorers.values()):
            raise ValueError(f"an {self.actor} needs explorers; name at least one with a share")
        return self


class Recipe(BaseModel):
    """A file in ``configs/collections``.

    Attributes:
        description: a sentence for people.
        parts: the parts, in the order in which they are collected.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    description: str = ""
    parts: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]*$")], Part]

    @property
    def size(self) -> int:
        """How many trajectories it asks for."""
        return sum(sum(part.types.values()) for part in self.parts.values())


def load_recipe(name: str = DEFAULT) -> Recipe:
    """Read a recipe of ``configs/collections`` by name, or any YAML file by path.

    Raises:
        ValueError: there is no such file, or it is not a recipe.
    """
    return configs.load(Recipe, configs.file_of("collections", name, "recipe"), "recipe")


def quotas(recipe: Recipe, limit: int | None, types: set[str]) -> dict[tuple[str, str], int]:
    """How many trajectories to take, by part and task type.

    Types without tasks are left out, and the others of the part take their shares. Rounding follows
    the largest remainder, over the whole recipe, so that the numbers sum to ``limit``.

    Args:
        recipe: the recipe.
        limit: how many in all; None for the recipe's own number.
        types: the task types that there are tasks of.
    """
    wanted: dict[tuple[str, str], float] = {}
    for name, part in recipe.parts.items():
        there = {kind: number for kind, number in part.types.items() if kind in types and number}
        if there:
            factor = sum(part.types.values()) / sum(there.values())
            wanted |= {(name, kind): number * factor for kind, number in there.items()}
    total = sum(wanted.values())
    if not total:
        return {}
    return _rounded(wanted, round(total) if limit is None else limit)


def _rounded(shares: Mapping[tuple[str, str], float], total: int) -> dict[tuple[str, str], int]:
    """Whole numbers in the proportion of some shares that sum to ``total``."""
    whole = sum(shares.values())
    exact = {key: share * total / whole for key, share in shares.items()}
    taken = {key: int(number) for key, number in exact.items()}
    missing = total - sum(taken.values())
    by_remainder = sorted(exact, key=lambda key: (taken[key] - exact[key], key))
    return {key: number + (key in by_remainder[:missing]) for key, number in taken.items()}
