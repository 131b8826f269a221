"""Episodes that act one after the other, and tell together what they saw.

Most of a step is one engine's work. What follows, from what is in view to the action mask, the
memory and the observation ``state``, is arithmetic on small arrays, and costs mostly the calls of
NumPy. A :class:`Group` does it once for all its members.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.actions import ACTIONS
from er_gym.envs.episode import Episode, ResetResult
from er_gym.envs.observations import OBSERVATIONS, STATE_LAYOUT, Situation
from er_gym.envs.skills import Outcome
from er_gym.envs.vector.legality import InRooms, available_together, legal_together
from er_gym.envs.vector.states import Memories, fill_states

_STATE = "state"


@dataclass(frozen=True, eq=False)
class Telling:
    """What an episode has to tell.

    Attributes:
        episode: whose it is.
        arguments: what the action led to, as :class:`~er_gym.envs.episode.Episode` states it.
        obs, info: empty until the group has told.
    """

    episode: MemberEpisode
    arguments: tuple[Any, ...]
    obs: dict[str, Any] = field(default_factory=dict)
    info: dict[str, Any] = field(default_factory=dict)


class MemberEpisode(Episode):
    """An episode of the default protocol that waits for its group before it tells what it saw.

    Attributes:
        group: None for none; the episode then is like any other.
        row: its place in the group.
    """

    group: Group | None = None
    row = 0

    def join(self, group: Group, row: int) -> None:
        """Become a member, once the episode has begun."""
        group.memories.adopt(row, self._memory, self.task.instruction)
        group.masks[row] = self.action_mask()
        kinds = self._settings.observations
        if kinds.get(_STATE) is OBSERVATIONS.get(_STATE):
            own = {_STATE: replace(kinds[_STATE], build=group.state_of)}
            self._settings = replace(self._settings, observations={**kinds, **own})
        self.group, self.row = group, row

    def action_mask(self) -> NDArray[np.int8]:
        """(len(ACTIONS),) int8: 1 for each action that is legal now."""
        return super().action_mask() if self.group is None else self.group.masks[self.row].copy()

    def _perceive(self, outcome: Outcome) -> None:
        if self.group is None:
            super()._perceive(outcome)
            return
        if not self.group.waits:  # somebody steps this environment alone
            super()._perceive(outcome)
            self.group.masks[self.row] = super().action_mask()
            return
        if outcome.views:
            super()._perceive(replace(outcome, perception=None))
        if outcome.perception is not None:
            self.perception = outcome.perception
            self.group.seen.append(self)

    def _told(self, *arguments: Any) -> ResetResult:
        if self.group is None or not self.group.waits:
            return super()._told(*arguments)
        telling = Telling(self, arguments)
        self.group.told.append(telling)
        return telling.obs, telling.info

    def tell(self, arguments: tuple[Any, ...]) -> ResetResult:
        """Tell what had to wait."""
        return super()._told(*arguments)


class Group:
    """n episodes.

    Args:
        n: their number.

    Attributes:
        memories: of all.
        masks: (n, len(ACTIONS)) int8, the action mask of each.
        waits: whether members wait now.
        seen: the members that have perceived something new, in order.
        told: what members have to tell, in order.
    """

    def __init__(self, n: int) -> None:
        self.memories = Memories(n)
        self.masks = np.zeros((n, len(ACTIONS)), np.int8)
        self.waits = False
        self.seen: list[MemberEpisode] = []
        self.told: list[Telling] = []
        self._vectors: NDArray[np.float32] | None = None
        self._situations: list[Situation] = []
        self._plain_state = OBSERVATIONS.get(_STATE).build

    @contextmanager
    def together(self) -> Iterator[None]:
        """Within it, members that act return an empty observation and ``info``. Both are filled at
        its end, of the members before an error, too."""
        self.waits = True
        try:
            yield
        finally:
            self.waits = False
            try:
                self._look()
                self._tell()
            finally:
                self.seen, self.told = [], []

    def state_of(self, situation: Situation) -> NDArray[np.float32]:
        """The observation ``state``; while all tell, it is filled after the last."""
        if self._vectors is None:
            return np.asarray(self._plain_state(situation))
        self._situations.append(situation)
        return np.asarray(self._vectors[len(self._situations) - 1])

    def _look(self) -> None:
        """What :meth:`Episode._perceive` does, for all who have perceived something."""
        members = self.seen
        if not members:
            return
        perceptions = [member.perception for member in members]
        goals = [member._handler.navigated_to for member in members]
        rooms = InRooms.of(perceptions, goals)
        visible = rooms.types(rooms.visible)
        for types, perception in zip(visible, perceptions, strict=True):
            perception.__dict__["visible_types"] = types  # so that it need not be computed again
        available = available_together(perceptions, rooms)
        known = [member._known for member in members]
        clear = rooms.types(rooms.navigable)
        before = np.array([types.types for types in known])
        for k in np.flatnonzero((clear & ~before).any(axis=1)).tolist():
            known[k].add(clear[k].nonzero()[0])
        for member, one in zip(members, available, strict=True):
            member._available = one
        agents = np.array([member.row for member in members])
        at = [member._navigated_to_kind for member in members]
        tables = [perception.objects for perception in perceptions]
        self.memories.look(agents, tables, at, rooms, visible)
        self.masks[agents] = legal_together(available, known, rooms)

    def _tell(self) -> None:
        self._vectors = np.zeros((len(self.told), len(STATE_LAYOUT)), np.float32)
        self._situations = []
        try:
            for telling in self.told:
                obs, info = telling.episode.tell(telling.arguments)
                telling.obs.update(obs)
                telling.info.update(info)
            if self._situations:
                agents = np.array([telling.episode.row for telling in self.told])
                fill_states(self._vectors, self.memories, agents, self._situations)
        finally:
            self._vectors = None
