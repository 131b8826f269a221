"""What an agent remembers of an episode: where things lay, and where it has been.

A model of a few million weights forgets what it saw in passing, and goes to places that it cannot
reach yet. A dialect with words for it tells the model: ``asked Mug seen at Shelf`` for a mug that
is out of view, and ``places Drawer 2/5, Sofa 1, Shelf`` for the places that it can go to, with how
often it was there and how many of them it has seen.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

from pydantic import BaseModel, ConfigDict

from er_gym.data.trajectory import SeenObject
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES


class PlaceWords(BaseModel):
    """The words for the places that an agent can go to; the line comes last.

    Attributes:
        told: lists them, ``{places}``.
        times: a place where it has been, with ``{place}`` and how often, ``{count}``.
        of: the same of several, of which it has seen ``{number}`` at once.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    told: str
    times: str
    of: str


@dataclass(frozen=True)
class Recalled:
    """What an agent remembers before it decides; by object type.

    Attributes:
        lay: on what it lay when it was in view last, or where the agent has put it since; ``""``
            for what was seen on nothing.
        visits: how often the agent went there.
        number: how many of them were in view at once, at most.
    """

    lay: Mapping[str, str] = field(default_factory=dict)
    visits: Mapping[str, int] = field(default_factory=dict)
    number: Mapping[str, int] = field(default_factory=dict)

    def having_done(self, action: Action | None, success: bool, held: str) -> Recalled:
        """What it remembers after an action.

        Args:
            action: None if nothing was done.
            success: whether it was done.
            held: the type that was in the hand before.
        """
        if action is None or not success:
            return self
        lay, visits, there = {**self.lay}, {**self.visits}, action.object_type
        if action.verb == verbs.NAVIGATE:
            visits[there] = visits.get(there, 0) + 1
        elif action.verb == verbs.PUT and held:
            lay[held] = there
        return Recalled(lay, visits, self.number)

    def having_seen(self, view: Sequence[SeenObject], around: Sequence[SeenObject]) -> Recalled:
        """What it remembers after it sees objects, ahead and in the views around."""
        number = {**self.number}
        seen: dict[str, int] = {}
        for one in (*view, *around):
            seen[one.type] = seen.get(one.type, 0) + 1
            number[one.type] = max(number.get(one.type, 0), seen[one.type])
        return Recalled({**self.lay, **where_each_lies(view, around)}, self.visits, number)


def where_each_lies(view: Sequence[SeenObject], around: Sequence[SeenObject]) -> dict[str, str]:
    """By type, on what the nearest lies; of the views around only if none is ahead."""
    return {one.type: one.on for one in (*reversed(around), *reversed(view))}


def places_text(words: PlaceWords, navigable: Iterable[str], recalled: Recalled) -> str:
    """The places that the agent can go to, in a line; ``""`` for none. What it could pick up is a
    place if it opens, such as a box, but no plate."""

    def place(name: str) -> str:
        count, number = recalled.visits.get(name, 0), recalled.number.get(name, 0)
        if not count:
            return name
        text = words.of if number > 1 else words.times
        filled = text.replace("{place}", name).replace("{count}", str(count))
        return filled.replace("{number}", str(number))

    told = ", ".join(place(each) for each in navigable if _is_place(each))
    return words.told.replace("{places}", told) if told else ""


@cache
def _is_place(object_type: str) -> bool:
    properties = OBJECT_TYPES[object_type].properties
    return "receptacle" in properties and (
        "pickupable" not in properties or "openable" in properties
    )
