"""The observation ``sightings``: where the named things were seen, also from afar, and how many
objects of each type there are.

``state`` and ``subtask`` tell by type what is in view, and what was in view where the agent stood.
Neither tells that a mug stands on the table over there, nor that two of five drawers are still
closed. Both follow from the objects in view (:class:`er_gym.envs.object_view.ObjectView`). Objects
of a type are told apart by their ids, as by an agent that never mistakes one for another.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import exp
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.rl.subtask_memory import logarithms
from agents.rl.subtasks import Progress
from er_gym.envs.info import detail
from er_gym.envs.object_view import ObjectView, apart
from er_gym.thor.objects import KIND_OF, TYPES

_ROLES = ("thing", "place")
SIGHTING_FEATURES = (
    *(f"{role} {where}" for role in _ROLES for where in ("on it", "near it")),
    *("number", "closed", "nearness"),
)
"""The features of each object type in ``sightings``, from 0 to 1:

- ``thing on it``, ``place on it``: the thing of the subtask at hand, or its place (to slice, the
  knife), lay in or on one of this type when it was in view last: 1 if it is in view now;
- ``thing near it``, ``place near it``: how near to one of this type it was then: 1 at no distance,
  1/e at one metre; less if it is not in view now;
- ``number``: how many different objects of the type the agent has seen in the episode; ``closed``:
  how many of them were closed when it last saw them; both as a logarithm, 1 for twenty;
- ``nearness``: of the nearest in view: 1 at no distance, 1/2 at one metre; 0 if none is in view.
"""
SIGHTING_LAYOUT = tuple(f"{feature}:{name}" for feature in SIGHTING_FEATURES for name in TYPES)
"""What each entry of ``sightings`` means, in order."""
_ROW = {feature: row for row, feature in enumerate(SIGHTING_FEATURES)}
_REMEMBERED = 0.7
"""What a sighting is worth once the thing is out of view."""


class _LastSeen(NamedTuple):
    """A type when it was in view last: on which type it lay, and how near to which."""

    on: int | None
    near: dict[int, float]


class SightingMemory:
    """Makes the observation ``sightings``, step by step.

    Args:
        progress: which subtask is at hand; whoever owns it keeps it up to date.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        names = {name for each in progress.subtasks for name in (each.thing, each.place)}
        self._named = names & KIND_OF.keys()
        self._sightings: dict[str, _LastSeen] = {}
        self._closed: dict[str, bool] = {}  # by object: whether it was closed when last seen
        self._counts = np.zeros((2, len(TYPES)), np.intp)  # of each type: all, and the closed

    def update(self, info: Mapping[str, Any]) -> NDArray[np.float32]:
        """Take in what is in view after a step.

        Args:
            info: what ``reset`` or ``step`` returned, with details, of an environment with the
                observation ``objects``.

        Returns:
            (len(SIGHTING_LAYOUT),) float32 from 0 to 1.
        """
        ahead: Sequence[ObjectView] = detail(info, "object_views")
        self._sightings.pop(info["held"], None)
        in_view = set[str]()
        for views in (*detail(info, "object_views_around").values(), ahead):
            for view in views:
                self._count(view)
            for name, sighting in self._sighted(views):
                self._sightings[name] = sighting
                in_view.add(name)
        return self._vector(ahead, in_view)

    def _count(self, view: ObjectView) -> None:
        """Count an object that is in view, once in the episode."""
        closed = view.is_open is False
        before = self._closed.get(view.object_id)
        if before != closed:
            kind = KIND_OF[view.object_type]
            self._counts[:, kind] += (before is None, closed - bool(before))
            self._closed[view.object_id] = closed

    def _sighted(self, views: Sequence[ObjectView]) -> Iterator[tuple[str, _LastSeen]]:
        """The named types among the objects of one view, which has the nearest first."""
        found = set[str]()
        for view in views:
            name = view.object_type
            if name not in self._named or name in found:
                continue
            found.add(name)
            near: dict[int, float] = {}
            for other in views:
                kind = KIND_OF[other.object_type]
                if other is not view:
                    near[kind] = max(near.get(kind, 0.0), exp(-apart(view, other)))
            yield name, _LastSeen(KIND_OF.get(view.on), near)

    def _vector(self, ahead: Sequence[ObjectView], in_view: set[str]) -> NDArray[np.float32]:
        table = np.zeros((len(SIGHTING_FEATURES), len(TYPES)), np.float32)
        table[[_ROW["number"], _ROW["closed"]]] = logarithms(self._counts)
        for view in reversed(ahead):  # the nearest is written last
            table[_ROW["nearness"], KIND_OF[view.object_type]] = 1.0 / (1.0 + view.distance)
        now = self._progress.at()
        if now is not None:
            for role, name in zip(_ROLES, (now.thing, now.place), strict=True):
                sighting = self._sightings.get(name)
                if sighting is None:
                    continue
                worth = 1.0 if name in in_view else _REMEMBERED
                if sighting.on is not None:
                    table[_ROW[f"{role} on it"], sighting.on] = worth
                for kind, nearness in sighting.near.items():
                    table[_ROW[f"{role} near it"], kind] = worth * nearness
        return table.ravel()
