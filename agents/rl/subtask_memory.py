"""The observation ``subtask``: the current subtask, and the agent's memory of its search.

Everything in it follows from the instruction, from the ``info`` that every agent gets, and from the
agent's own actions. It contains what ``state`` lacks: which of the named types is to be fetched and
which is the destination, the subtasks that are done, and the places searched since the search
began.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import log1p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.rl.subtasks import SUBTASK_VERBS, Progress, Subtask
from er_gym.envs.actions import INDICES, Action
from er_gym.envs.info import action_of, names
from er_gym.tasks import verbs
from er_gym.thor import placement_table
from er_gym.thor.objects import KIND_OF, TYPES

_AHEAD = 4
"""The number of subtasks, this one included, whose types are marked."""
ROLES = ("thing", "place", "next thing", "next place", "later")
_MEMORY = ("source", "tried", "visits", "opened now", "opened before", "opens", "same sight")
_SIGHTED = ("thing seen there", "place seen there", "fits")
_LEGAL = tuple(f"can {verb}" for verb in verbs.OBJECT_VERBS)
SUBTASK_FEATURES = (*ROLES, *_MEMORY, *_SIGHTED, *_LEGAL)
"""The features of each object type in ``subtask``, from 0 to 1:

- ``thing``, ``place``: the subtask at hand is about this type; puts it into this type, or slices
  with it; ``next thing``, ``next place``: the same for the next subtask about other types;
  ``later``: a later subtask names it;
- ``source``: the instruction says that the thing is in this type;
- ``tried``: how often the agent has navigated to it since the subtask began; ``visits``: in the
  whole episode; both as a logarithm, 1 for twenty times;
- ``opened now``, ``opened before``: the agent has opened one and not closed it, since the subtask
  began or before; ``opens``: how many it has opened, as a logarithm;
- ``same sight``: on arrival there the agent saw what it had already seen on an earlier arrival;
- ``thing seen there``, ``place seen there``: the type was in view while the agent was there;
- ``fits``: AI2-THOR allows to put the thing, or what is carried, there;
- ``can`` and a verb: the action is legal now.
"""
SUBTASK_SCALARS = (
    *(f"now {verb}" for verb in SUBTASK_VERBS),
    *(f"next {verb}" for verb in SUBTASK_VERBS),
    *("all done", "left", "moved on", "since", "observed", "observed ever"),
    *("steps left", "two transfers"),
)
"""The features of the subtask in ``subtask``, from 0 to 1:

- ``now`` and ``next`` with a verb of :data:`~agents.rl.subtasks.SUBTASK_VERBS`: what the subtask at
  hand and the next one ask for; ``all done``: there is none any more; ``left``: how many, an eighth
  each;
- ``moved on``: the last action completed a subtask; ``since``: the steps since then, as a
  logarithm;
- ``observed``: whether the agent has observed since the subtask began, a third each time;
  ``observed ever``: whether it has in the episode;
- ``steps left``: until the step limit, as a share of 36;
- ``two transfers``: the instruction consists of two transfers, whose order counts.
"""
SUBTASK_LAYOUT = (
    *SUBTASK_SCALARS,
    *(f"{feature}:{name}" for feature in SUBTASK_FEATURES for name in TYPES),
)
"""What each entry of ``subtask`` means, in order, as
:data:`~er_gym.envs.observations.STATE_LAYOUT` does for ``state``."""
_ROW = {feature: row for row, feature in enumerate(SUBTASK_FEATURES)}
_PLACE = {name: place for place, name in enumerate(SUBTASK_SCALARS)}
_MOST = 20
"""Counts are the same from here on."""
_LONGEST = 36
_INDICES = np.stack([INDICES[verb] for verb in verbs.OBJECT_VERBS])  # (V, T)
_FITS = {
    thing: np.array([KIND_OF[place] for place in places if place in KIND_OF], np.intp)
    for thing, places in placement_table().items()
}


def _logarithm(count: int) -> float:
    return min(1.0, log1p(count) / log1p(_MOST))


_LOGARITHMS = np.array([_logarithm(count) for count in range(_MOST + 1)], np.float32)


def logarithms(counts: NDArray[np.intp]) -> NDArray[np.float32]:
    """Of the same shape, from 0 to 1, which is for twenty and more."""
    return np.asarray(_LOGARITHMS[np.minimum(counts, _MOST)])


class SubtaskMemory:
    """Makes the observation ``subtask`` from ``info``, step by step.

    Args:
        instruction: the task's instruction.

    Attributes:
        progress: which subtask is at hand.
        tried: (T,) how often the agent has navigated to each type since the subtask began.
        observed: how often it has observed since then.
        moved_on: whether the last action completed a subtask.
    """

    def __init__(self, instruction: str) -> None:
        self.progress = Progress(instruction)
        self._two_transfers = [each.verb for each in self.progress.subtasks] == [
            *(verbs.PICKUP, verbs.PUT) * 2
        ]
        count = len(TYPES)
        self.tried = np.zeros(count, np.intp)
        self._visits = np.zeros(count, np.intp)
        self._opens = np.zeros(count, np.intp)
        self._opened_now = np.zeros(count, bool)
        self._opened_before = np.zeros(count, bool)
        self._same_sight = np.zeros(count, bool)
        self._seen_at = np.zeros((count, count), bool)  # place, type
        self._sights: set[tuple[int, object]] = set()
        self._at: int | None = None
        self.moved_on = False
        self._since = self.observed = self._observed_ever = 0

    def update(self, info: Mapping[str, Any]) -> NDArray[np.float32]:
        """Take in a step.

        Args:
            info: what ``reset`` or ``step`` returned.

        Returns:
            (len(SUBTASK_LAYOUT),) float32 from 0 to 1.
        """
        action = action_of(info) if info["action_success"] else None
        reach = frozenset(names(info["interactable_mask"]))
        self._since += 1
        if action is not None:
            self._remember(action, info)
        if self._at is not None:
            self._seen_at[self._at, info["visible_mask"] > 0] = True
        self.moved_on = self.progress.update(action, info["held"], reach)
        if self.moved_on:
            self._since = self.observed = 0
            self.tried[:] = 0
            self._opened_before |= self._opened_now
            self._opened_now[:] = False
        return self._vector(info)

    def _remember(self, action: Action, info: Mapping[str, Any]) -> None:
        if action.verb == verbs.OBSERVE:
            self.observed += 1
            self._observed_ever = 1
        kind = KIND_OF.get(action.object_type)
        if kind is None:
            return
        if action.verb == verbs.NAVIGATE:
            self._at = kind
            self.tried[kind] += 1
            self._visits[kind] += 1
            seen, reach = (info[f"{name}_mask"].tobytes() for name in ("visible", "interactable"))
            sight = (kind, (seen, reach, info["held"]))
            self._same_sight[kind] |= sight in self._sights
            self._sights.add(sight)
        elif action.verb == verbs.OPEN:
            self._opens[kind] += 1
            self._opened_now[kind] = True
        elif action.verb == verbs.CLOSE:
            self._opened_now[kind] = self._opened_before[kind] = False

    # -- the vector ------------------------------------------------------------------------------

    def _vector(self, info: Mapping[str, Any]) -> NDArray[np.float32]:
        vector = np.zeros(len(SUBTASK_LAYOUT), np.float32)
        now, following = self.progress.at(), self.progress.at(1)
        for subtask, when in ((now, "now"), (following, "next")):
            if subtask is not None:
                vector[_PLACE[f"{when} {subtask.verb}"]] = 1.0
        left = len(self.progress.subtasks) - self.progress.number
        for name, value in (
            ("all done", float(now is None)),
            ("left", min(left / 8, 1.0)),
            ("moved on", float(self.moved_on)),
            ("since", _logarithm(self._since)),
            ("observed", min(self.observed / 3, 1.0)),
            ("observed ever", float(self._observed_ever)),
            ("steps left", min(max(info["max_steps"] - info["steps"], 0) / _LONGEST, 1.0)),
            ("two transfers", float(self._two_transfers)),
        ):
            vector[_PLACE[name]] = value
        table = vector[len(SUBTASK_SCALARS) :].reshape(len(SUBTASK_FEATURES), len(TYPES))
        table[_ROW["tried"]] = logarithms(self.tried)
        table[_ROW["visits"]] = logarithms(self._visits)
        table[_ROW["opens"]] = logarithms(self._opens)
        table[_ROW["opened now"]] = self._opened_now
        table[_ROW["opened before"]] = self._opened_before
        table[_ROW["same sight"]] = self._same_sight
        table[_ROW[_LEGAL[0]] :] = (_INDICES >= 0) & (info["action_mask"][_INDICES] > 0)
        if now is not None:
            self._mark(table, now)
        return vector

    def _mark(self, table: NDArray[np.float32], now: Subtask) -> None:
        """Mark the types of the subtasks, and what is known about where they are."""
        thing, place = _roles(now)
        for role, kind in (("thing", thing), ("place", place)):
            if kind is not None:
                table[_ROW[role], kind] = 1.0
                table[_ROW[f"{role} seen there"]] = self._seen_at[:, kind]
        if now.source in KIND_OF:
            table[_ROW["source"], KIND_OF[now.source]] = 1.0
        if now.thing in _FITS:
            table[_ROW["fits"], _FITS[now.thing]] = 1.0
        marked = {thing, place}
        roles = ("next thing", "next place")
        for ahead in range(1, _AHEAD):
            subtask = self.progress.at(ahead)
            if subtask is None or set(_roles(subtask)) <= marked:
                continue
            for role, kind in zip(roles, _roles(subtask), strict=True):
                if kind is not None:
                    table[_ROW[role], kind] = 1.0
            marked.update(_roles(subtask))
            roles = ("later", "later")


def _roles(subtask: Subtask) -> tuple[int | None, int | None]:
    """The indices of the types of a subtask: of its thing and of its place."""
    return KIND_OF.get(subtask.thing), KIND_OF.get(subtask.place)
