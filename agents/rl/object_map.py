"""The observation ``object_map``: where objects are that the agent has seen, which of them it has
been to, and from where it has looked.

``subtask`` and ``sightings`` count by type. Neither tells that the next drawer stands beside two
others that are still closed, that one open drawer covers another, or that the kettle stands on the
part of the counter that the agent has not looked at yet. A thing that is behind others is seen from
another place, and to go to something that stands near it is how the agent gets there.

Positions follow from the bearing and distance of what is in view
(:class:`er_gym.envs.object_view.ObjectView`) and from the agent's own position in ``state``, both
relative to where the episode began; ``state`` tells it up to ten metres from there. Objects of a
type are told apart by their ids.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import atan2, cos, pi, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.rl.subtask_memory import FITS, logarithms
from agents.rl.subtasks import Progress
from er_gym.envs.info import detail
from er_gym.envs.object_view import ObjectView
from er_gym.envs.observations import ROOM_SCALE, SCALARS
from er_gym.envs.skills import VIEWS
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES

MAP_FEATURES = (
    *("unvisited", "unopened", "covered"),
    *("next open", "next on fitting", "next new", "next looks", "next to unopened"),
)
"""The features of each object type in ``object_map``, from 0 to 1. Counts are logarithms, 1 for
twenty.

- ``unvisited``: how many known objects of the type the agent has not navigated to;
- ``unopened``: how many it has never seen open, of those in which the thing that it looks for may
  be: where the instruction says, or else where AI2-THOR allows to put it;
- ``covered``: how many are open where another of the type is open, above or below it;
- ``next …``: of the known one to which ``navigate to`` goes next, the nearest not yet visited
  (with ``instances: explore``, if none that was never seen is nearer):
  ``open``: whether it was open when last seen; ``on fitting``: whether it lay then on or in
  something where the thing may be; ``new``: how far it is from all places where the agent has been
  since the subtask began, 0 at no distance, 1 - 1/e at one metre; ``looks``: at how many steps
  since then the agent was within 1.5 m of it; ``to unopened``: how many others within a metre of it
  count as ``unopened``.
"""
MAP_LAYOUT = tuple(f"{feature}:{name}" for feature in MAP_FEATURES for name in TYPES)
"""What each entry of ``object_map`` means, in order."""
_ROW = {feature: row for row, feature in enumerate(MAP_FEATURES)}
_POSE = [SCALARS.index(name) for name in ("right", "ahead", "sin", "cos")]
_TURNED = dict(zip(VIEWS, (pi / 2, pi, 3 * pi / 2), strict=True))
_STACKED, _BESIDE, _CLOSE = 0.25, 1.0, 1.5
"""Metres along the floor: between the middles of drawers of one stack; of containers that can be
opened from one place; and from where a place is looked at well."""
_NOWHERE = -1
_FACTS = ("right", "ahead", "kind", "on", "held", "opens", "open", "was open", "visited")
"""What is known of an object: where it was seen last, metres; its type, and that of what it lay on;
whether it has been in the hand since; whether it can be opened, is open, and has ever been;
whether the agent has navigated to it."""
_KIND, _ON, _HELD, _OPENS, _OPEN, _WAS_OPEN, _VISITED = range(2, len(_FACTS))
_LATER = _WAS_OPEN
"""From here on a fact does not follow from one view."""


class ObjectMap:
    """Makes the observation ``object_map``, step by step.

    Args:
        progress: which subtask is at hand; whoever owns it keeps it up to date.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._number = -1  # of the subtask at the last step
        self._column: dict[str, int] = {}  # by object
        self._facts = np.zeros((len(_FACTS), 64))
        self._visited: dict[str, set[str]] = {}  # by type: the objects navigated to
        self._stands: list[tuple[float, float]] = []

    def update(self, state: NDArray[np.float32], info: Mapping[str, Any]) -> NDArray[np.float32]:
        """Take in a step.

        Args:
            state: the environment's observation ``state``.
            info: what ``reset`` or ``step`` returned, with details, of an environment with the
                observation ``objects``.

        Returns:
            (len(MAP_LAYOUT),) float32 from 0 to 1.
        """
        right, ahead, sine, cosine = state[_POSE].tolist()
        at, heading = (right * ROOM_SCALE, ahead * ROOM_SCALE), atan2(sine, cosine)
        for name, views in detail(info, "object_views_around").items():
            self._see(views, at, heading + _TURNED[name])
        self._see(detail(info, "object_views"), at, heading)
        self._go(info)
        if self._progress.number != self._number:
            self._number = self._progress.number
            self._stands.clear()
        self._stands.append(at)
        return self._vector(at)

    def _see(self, views: Iterable[ObjectView], at: tuple[float, float], heading: float) -> None:
        """Note where the objects of one view are, in which the agent looks along ``heading``."""
        right, ahead = at
        for view in views:
            angle, is_open = heading + radians(view.bearing), bool(view.is_open)
            column = self._column.setdefault(view.object_id, len(self._column))
            if column == self._facts.shape[1]:
                self._facts = np.concatenate([self._facts, np.zeros_like(self._facts)], axis=1)
            visited = self._visited.get(view.object_type, ())
            self._facts[_VISITED, column] = view.object_id in visited
            self._facts[:_LATER, column] = (
                right + view.distance * sin(angle),
                ahead + view.distance * cos(angle),
                KIND_OF[view.object_type],
                KIND_OF.get(view.on, _NOWHERE),
                False,
                view.is_open is not None,
                is_open,
            )
            if is_open:
                self._facts[_WAS_OPEN, column] = True

    def _go(self, info: Mapping[str, Any]) -> None:
        """Note what the agent went to, opened, closed or picked up."""
        verb, name = info["verb"], info["object_id"]
        column = self._column.get(name)
        known = None if column is None else self._facts[:, column]
        if verb == verbs.NAVIGATE and name:
            visited = self._visited.setdefault(info["object_type"], set())
            if name in visited:  # all have been visited, and a new round begins
                visited.clear()
                kind = KIND_OF.get(info["object_type"], _NOWHERE)
                self._facts[_VISITED, self._facts[_KIND] == kind] = False
            visited.add(name)
            if known is not None:
                known[_VISITED] = True
        elif known is not None and info["action_success"]:
            if verb in (verbs.OPEN, verbs.CLOSE):
                known[_OPEN], known[_WAS_OPEN] = verb == verbs.OPEN, True
            elif verb == verbs.PICKUP:
                known[_HELD] = True

    # -- the vector ------------------------------------------------------------------------------

    def _vector(self, at: tuple[float, float]) -> NDArray[np.float32]:
        table = np.zeros((len(MAP_FEATURES), len(TYPES)), np.float32)
        facts = self._facts[:, : len(self._column)]
        facts = facts[:, facts[_HELD] == 0]
        if not facts.size:
            return table.ravel()
        places, kinds = facts[0] + 1j * facts[1], facts[_KIND].astype(np.intp)
        opens, is_open, was_open, visited = facts[_OPENS:] > 0
        holders = self._holders()
        unopened = holders[kinds] & opens & ~was_open
        for feature, which in (
            ("unvisited", ~visited),
            ("unopened", unopened),
            ("covered", _covered(places, kinds, is_open)),
        ):
            table[_ROW[feature]] = logarithms(np.bincount(kinds[which], minlength=len(TYPES)))
        # By type, the nearest not yet visited is written last; the nearest if all have been.
        order = np.lexsort((-abs(places - complex(*at)), ~visited))
        following = np.full(len(TYPES), _NOWHERE)
        following[kinds[order]] = order
        kind = np.flatnonzero(following >= 0)
        chosen = following[kind]
        there, on = places[chosen], facts[_ON, chosen].astype(np.intp)
        far = abs(there[:, None] - np.array([complex(*stand) for stand in self._stands]))
        near = abs(there[:, None] - places[unopened]) < _BESIDE
        table[_ROW["next open"], kind] = is_open[chosen]
        table[_ROW["next on fitting"], kind] = holders[on] & (on >= 0)
        table[_ROW["next new"], kind] = 1.0 - np.exp(-far.min(axis=1))
        table[_ROW["next looks"], kind] = logarithms((far < _CLOSE).sum(axis=1))
        table[_ROW["next to unopened"], kind] = logarithms(near.sum(axis=1) - unopened[chosen])
        return table.ravel()

    def _holders(self) -> NDArray[np.bool_]:
        """(T,) whether the thing that the agent looks for may be in or on each type."""
        holders, now = np.zeros(len(TYPES), bool), self._progress.at()
        if now is not None:
            if now.source in KIND_OF:
                holders[KIND_OF[now.source]] = True
            elif now.sought in FITS:
                holders[FITS[now.sought]] = True
        return holders


def _covered(
    places: NDArray[np.complex128], kinds: NDArray[np.intp], is_open: NDArray[np.bool_]
) -> NDArray[np.intp]:
    """Which of N objects are open, and above or below another open one of their type."""
    which = np.flatnonzero(is_open)
    together = abs(places[which, None] - places[which]) < _STACKED
    together &= kinds[which, None] == kinds[which]
    return np.asarray(which[together.sum(axis=1) > 1])  # each is together with itself
