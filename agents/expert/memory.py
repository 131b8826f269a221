"""What the agent of a course has seen so far, and where: it goes back there and does not search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agents.expert.course import View
from er_gym.data.claims import PARTS
from er_gym.envs.object_view import ObjectView, nearest_to
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among, same_type


@dataclass(frozen=True)
class Sighting:
    """Where a thing was when it was in view last.

    Attributes:
        thing: its type.
        on: the type of what it lay in or on, ``""`` if none was in view.
        near: the types that were in view with it, the nearest to it first.
    """

    thing: str
    on: str = ""
    near: tuple[str, ...] = ()

    @property
    def ways(self) -> tuple[str, ...]:
        """Where to go for it, the best first."""
        return tuple(name for name in dict.fromkeys((self.on, self.thing, *self.near)) if name)

    def fits(self, place: str) -> bool:
        """Whether it may have been at a place: nothing says that it lay in or on another."""
        here = (self.thing, self.on, *PARTS.get(self.on, ()))
        return not self.on or is_among(place, here)


class Memory:
    """Remembers every type that was in view and not in the hand.

    Attributes:
        at: the type that the agent last navigated to, ``""`` at first.
    """

    def __init__(self) -> None:
        self.at = ""
        self._seen: dict[str, Sighting] = {}
        self._held = ""

    def take(self, view: View) -> None:
        """Take in what is in view after a step, and what the step has moved."""
        if view.action is not None and view.success:
            if view.action.verb == verbs.NAVIGATE:
                self.at = view.action.object_type
            if view.action.verb == verbs.PUT and self._held:
                self._seen[self._held] = Sighting(self._held, view.action.object_type)
        self._held = view.held
        ahead: Sequence[ObjectView] = view.info.get("object_views", ())
        around = view.info.get("object_views_around", {}).values()
        for views in (*around, ahead):
            for each in reversed(views):  # the nearest of a type comes last and stays
                self._seen[each.object_type] = Sighting(
                    each.object_type, each.on, nearest_to(each, views)
                )
        self._seen.pop(self._held, None)

    def of(self, thing: str) -> Sighting | None:
        """The last sighting of a type, or of one that counts as the same; None if there is none."""
        if thing in self._seen:
            return self._seen[thing]
        return next((one for kind, one in self._seen.items() if same_type(kind, thing)), None)


class Remembering:
    """A course that remembers every view it is shown."""

    def __init__(self) -> None:
        self._memory = Memory()

    @property
    def view(self) -> View:
        """See :class:`~agents.expert.course.Course`."""
        return self._view

    @view.setter
    def view(self, view: View) -> None:
        self._view = view
        self._memory.take(view)
