"""Places where an object may be: plausible wrong ones, and an explorer's next one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from random import Random
from typing import Protocol

from agents.scripted.searcher import search_priors
from er_gym.rollout.agent import ModelReply
from er_gym.tasks.equivalence import same_type

_BELOW_ANY = 0.01
"""The likelihood of a place that AI2-THOR does not allow for the object."""
_NOT_SEARCHED = frozenset({"Floor", "StoveBurner", "Toaster", "CoffeeMachine", "Chair", "Stool"})
"""Receptacles in which nobody looks for a thing first."""
_ONLY_FOR_SMALL = frozenset({"GarbageCan", "LaundryHamper", "Box", "Toilet", "TowelHolder"})
"""Receptacles in or on which no fixed object stands."""


def likely_places(
    thing: str, navigable: Iterable[str], without: Iterable[str] = ()
) -> list[tuple[str, float]]:
    """The places where a person would search for an object, each with a weight.

    Args:
        thing: the type of the object.
        navigable: the types that the agent may go to.
        without: types that are left out, with their equivalents (Sink for SinkBasin).
    """
    left_out = (thing, *without)
    fixed = not search_priors.has(thing, "pickupable")
    found: list[tuple[str, float]] = []
    for place in navigable:
        if not search_priors.has(place, "receptacle") or place in search_priors.MOBILE:
            continue
        if fixed and (search_priors.opens(place) or place in _ONLY_FOR_SMALL):
            continue
        if place in _NOT_SEARCHED or any(same_type(place, each) for each in left_out):
            continue
        if any(same_type(place, other) for other, _ in found):
            continue
        found.append((place, max(search_priors.likelihood(thing, place), _BELOW_ANY)))
    return found


def draw_places(
    weighted: Sequence[tuple[str, float]], number: int, random: Random, temperature: float = 1.0
) -> list[str]:
    """Different places, drawn by weight: likelier places are drawn more often, and come earlier.

    Args:
        weighted: places with their weights.
        number: how many at the most.
        random: draws.
        temperature: 1 draws by the weights, 0 takes the likeliest first, larger is more random.
    """
    if temperature <= 0:
        order = sorted(weighted, key=lambda each: (-each[1], each[0]))
        return [place for place, _ in order[:number]]
    # The largest of log w / T + Gumbel noise is a draw by w ** (1 / T), without replacement.
    noisy = [
        (math.log(weight) / temperature - math.log(-math.log(random.random() or 1e-12)), place)
        for place, weight in weighted
    ]
    return [place for _, place in sorted(noisy, reverse=True)[:number]]


class PlaceChooser(Protocol):
    """Chooses the wrong places of a search."""

    def choose(
        self, thing: str, weighted: Sequence[tuple[str, float]], number: int, random: Random
    ) -> list[str]:
        """Different places in the order in which they are to be searched.

        Args:
            thing: the type of the object that is searched for.
            weighted: the places there are, with their weights.
            number: how many at the most.
            random: draws whatever is to be drawn.

        Raises:
            CannotGoOn: a model is asked, and no later request can succeed either.
        """

    def take_replies(self) -> Sequence[ModelReply]:
        """What a model has replied since the last call; empty where none is asked."""


class DrawnPlaces:
    """Draws places by their likelihood; a :class:`PlaceChooser`."""

    def choose(
        self, thing: str, weighted: Sequence[tuple[str, float]], number: int, random: Random
    ) -> list[str]:
        """See :func:`draw_places`."""
        return draw_places(weighted, number, random)

    def take_replies(self) -> Sequence[ModelReply]:
        """Empty: no model is asked."""
        return ()


def plan_of(mode: str, right: str, wrong: Sequence[str]) -> list[str]:
    """The places of a plan: the right one where the mode has a 1, wrong ones elsewhere.

    A plan is shorter than its mode if there are too few wrong places.
    """
    spare = iter(wrong)
    places = (right if digit == "1" else next(spare, "") for digit in mode)
    return [place for place in places if place]
