"""Recipes: how many trajectories of which parts and task types a collection has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import floor
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from agents.configs import ConfigKind
from agents.expert.explorer import Strength
from agents.expert.kinds import MODES
from er_gym.envs.faults import fault_rates
from er_gym.tasks.types import shares_by_name

DEFAULT = "paper"
ANOMALY, EXPLORED, CORRECTED = "anomaly", "explored", "corrected"
"""Kinds of trajectories beside the expert's ``a``, ``b`` and ``c``: things go wrong, an explorer
plays, a failed episode is corrected."""
SEARCH = "search"
"""The mode of an explorer's trajectory in which something must have been searched for."""
_HALF = Fraction(1, 2)
_MOST = 10_000_000
"""A part has at most this many trajectories of a task type."""
Share = Annotated[float, Field(ge=0, allow_inf_nan=False)]


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
    types: dict[str, Annotated[int, Field(ge=0, le=_MOST)]]
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
        types = shares_by_name(types)
        if not any(types.values()):
            raise ValueError(f"{types} asks for nothing; let at least one number be above 0")
        return types

    @field_validator("faults", mode="before")
    @classmethod
    def _known_faults(cls, faults: Any) -> dict[str, float]:
        return fault_rates(faults)

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

    @property
    def all_kinds(self) -> tuple[str, ...]:
        """The kinds of trajectories that it may have."""
        if self.actor == "expert":
            return tuple(kind for kind, share in self.kinds.items() if share)
        return (EXPLORED if self.actor == "explorer" else CORRECTED,)


class Recipe(BaseModel):
    """A file in ``configs/collections``.

    Attributes:
        description: a sentence for people.
        parts: the parts, in the order in which they are collected.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    description: str = ""
    parts: Annotated[
        dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]{0,59}$")], Part], Field(min_length=1)
    ]

    @property
    def size(self) -> int:
        """How many trajectories it asks for."""
        return sum(sum(part.types.values()) for part in self.parts.values())

    def only(self, parts: Sequence[str]) -> Recipe:
        """The recipe with these parts alone; with all if none is given.

        Raises:
            ValueError: it has no such part.
        """
        for part in parts:
            if part not in self.parts:
                raise ValueError(f"unknown part {part!r}; the recipe has: {', '.join(self.parts)}")
        chosen = {name: part for name, part in self.parts.items() if not parts or name in parts}
        return self.model_copy(update={"parts": chosen})


RECIPES = ConfigKind(Recipe, "collections", "recipe")


def load_recipe(name: str = DEFAULT) -> Recipe:
    """Read a recipe by name or path; see :meth:`agents.configs.ConfigKind.load`."""
    return RECIPES.load(name)


def quotas(recipe: Recipe, limit: int | None, types: set[str]) -> dict[tuple[str, str], int]:
    """How many trajectories to take, by part and task type.

    Types without tasks are left out, and the others of the part take their shares. The numbers sum
    to ``limit``; each is its share times a factor that is the same for all, rounded. With a larger
    limit, none of them is smaller, so that a collection can grow.

    Args:
        recipe: the recipe.
        limit: how many in all; None for the recipe's own number.
        types: the task types that there are tasks of.
    """
    wanted: dict[tuple[str, str], Fraction] = {}
    for name, part in recipe.parts.items():
        there = {kind: number for kind, number in part.types.items() if kind in types and number}
        if there:
            factor = Fraction(sum(part.types.values()), sum(there.values()))
            wanted |= {(name, kind): number * factor for kind, number in there.items()}
    total = sum(wanted.values())
    if not total:
        return {}
    return _rounded(wanted, round(total) if limit is None else limit)


def _rounded(shares: Mapping[tuple[str, str], Fraction], total: int) -> dict[tuple[str, str], int]:
    """Whole numbers in the proportion of some shares that sum to ``total``.

    The method of Webster and Sainte-Laguë: ``round(share * factor)`` with the factor that gives
    the total. A large share may so miss its exact part of the total by more than 1 (at most by 1/2,
    and its part of 1/2 for each of the shares). The largest remainder stays within 1, but there a
    number may become smaller when the total grows.
    """
    whole = sum(shares.values())
    taken = {key: floor(share * total / whole + _HALF) for key, share in shares.items()}
    while sum(taken.values()) < total:
        taken[min(shares, key=lambda key: ((taken[key] + _HALF) / shares[key], key))] += 1
    while sum(taken.values()) > total:
        taken[max(shares, key=lambda key: ((taken[key] - _HALF) / shares[key], key))] -= 1
    return taken
