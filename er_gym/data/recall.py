"""What an agent remembers of an episode: where things lay, and where it has been.

A model of a few million weights forgets what it saw in passing, and goes to places that it cannot
reach yet. A dialect with words for it tells the model: ``asked Mug seen at Shelf`` for a mug that
is out of view (``at far Shelf`` if it cannot go to the shelf), and ``places Drawer 2/5 open 1,
Shelf, Sofa 1`` for the places that it can go to, with how often it was there, how many of them it
has seen in one view, and how often it opened one.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

from pydantic import BaseModel, ConfigDict

from er_gym.data.trajectory import SeenObject
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES


class PlaceWords(BaseModel):
    """The words for the places that an agent can go to (:func:`places_text`); the line comes last.

    Attributes:
        told: lists them, ``{places}``.
        times: a place where it has been, with ``{place}`` and how often, ``{count}``.
        times_of_several: the same of a type of which it has seen ``{number}`` in one view.
        opened: follows for a place of which it has opened one ``{count}`` times, the same or
            others; ``""`` if that is not told.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    told: str
    times: str
    times_of_several: str
    opened: str = ""


@dataclass(frozen=True)
class Recalled:
    """What an agent remembers before it decides; by object type. It does not tell two objects of a
    type apart: of two mugs it remembers the one that it saw or put down last.

    Attributes:
        lay: on what it lay when it was in view last, or where the agent has put it since; ``""``
            for what was seen on nothing. What was sliced is forgotten.
        visits: how often the agent went there; ``opened``: how often it opened one.
        most_in_view: how many of them were in one view, at most.
    """

    lay: Mapping[str, str] = field(default_factory=dict)
    visits: Mapping[str, int] = field(default_factory=dict)
    opened: Mapping[str, int] = field(default_factory=dict)
    most_in_view: Mapping[str, int] = field(default_factory=dict)

    def having_done(self, action: Action | None, success: bool, held: str) -> Recalled:
        """What it remembers after an action.

        Args:
            action: None if nothing was done.
            success: whether it was done.
            held: the type that was in the hand before.
        """
        if action is None or not success:
            return self
        lay, there = {**self.lay}, action.object_type
        visits, opened = {**self.visits}, {**self.opened}
        if action.verb == verbs.NAVIGATE:
            visits[there] = visits.get(there, 0) + 1
        elif action.verb == verbs.OPEN:
            opened[there] = opened.get(there, 0) + 1
        elif action.verb == verbs.PUT and held:
            lay[held] = there
        elif action.verb == verbs.SLICE:
            lay.pop(there, None)
        return Recalled(lay, visits, opened, self.most_in_view)

    def having_seen(
        self, view: Sequence[SeenObject], views: Mapping[str, Sequence[SeenObject]]
    ) -> Recalled:
        """What it remembers after it sees objects, ahead and in the views around."""
        most = Counter(self.most_in_view)
        for each in (view, *views.values()):  # views overlap
            most |= Counter(one.type for one in each)
        lay = {**self.lay, **where_each_lies(view, views)}
        return replace(self, lay=lay, most_in_view=most)


def where_each_lies(
    view: Sequence[SeenObject], views: Mapping[str, Sequence[SeenObject]]
) -> dict[str, str]:
    """By type, on what the nearest ahead lies, or if none is ahead, the nearest of the first view
    around that has one."""
    around = [one for each in views.values() for one in each]
    return {one.type: one.on for one in (*reversed(around), *reversed(view))}


def lying_text(at: str, at_far: str, place: str, navigable: Collection[str]) -> str:
    """In or on what a thing lies, in words of a dialect.

    Args:
        at: the words, with ``{place}``.
        at_far: those for a place that the agent cannot navigate to; ``""`` for the same.
        place: its type; ``""`` for nothing, of which nothing is told.
        navigable: the types that it can navigate to.
    """
    words = at if place in navigable else at_far or at
    return words.replace("{place}", place) if place else ""


def places_text(words: PlaceWords, navigable: Iterable[str], recalled: Recalled) -> str:
    """The places that the agent can go to, in a line; ``""`` for none.

    A place is a receptacle that cannot be picked up, or one that opens, such as a box.
    """

    def place(name: str) -> str:
        count, number = recalled.visits.get(name, 0), recalled.most_in_view.get(name, 0)
        told = name
        if count:
            text = words.times_of_several if number > 1 else words.times
            told = text.replace("{place}", name).replace("{count}", str(count))
            told = told.replace("{number}", str(number))
        if opened := recalled.opened.get(name, 0):
            told += words.opened.replace("{count}", str(opened))
        return told

    told = ", ".join(place(each) for each in navigable if _is_place(each))
    return words.told.replace("{places}", told) if told else ""


@cache
def _is_place(object_type: str) -> bool:
    if object_type not in OBJECT_TYPES:  # tasks may name types that no room has
        return False
    properties = OBJECT_TYPES[object_type].properties
    return "receptacle" in properties and (
        "pickupable" not in properties or "openable" in properties
    )
