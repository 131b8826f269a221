"""What an attentive agent remembers of an episode, as the observations tell it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.actions import Action
from er_gym.envs.asked_goal import goal_row
from er_gym.envs.perception import Perception
from er_gym.tasks import verbs
from er_gym.tasks.task import AgentPose
from er_gym.thor.objects import KIND_OF, TYPES, ObjectTable

_OFTEN = 4
"""``did`` counts no further than this."""
MAX_REPEATS = 3
"""The number of times in a row that the same action is executed; one more ends the episode."""
REMEMBERED = ("seen", "is_open", "is_on", "found", "did")
"""The arrays of a memory that change as the episode goes on."""


def _nothing() -> NDArray[np.float32]:
    return np.zeros(len(TYPES), dtype=np.float32)


def _no_types() -> NDArray[np.bool_]:
    return np.zeros(len(TYPES), dtype=bool)


def _no_deeds() -> NDArray[np.float32]:
    return np.zeros((len(verbs.OBJECT_VERBS), len(TYPES)), dtype=np.float32)


@dataclass(eq=False)
class Memory:
    """What an attentive agent remembers of an episode. Arrays have one entry for each object type.

    Attributes:
        start: the agent's start pose.
        wanted: (T,) float32, the weight of each type in the instruction, :func:`.asked_goal.goal`.
        seen: (T,) bool, the types that the agent has seen.
        is_open, is_on: (T,) bool, whether one was open, or switched on, when last seen.
        found: (T,) float32, the greatest weight of the types in view at each type navigated to.
        did: (len(OBJECT_VERBS), T) how often the agent did each verb to each type, as a share of
            what ``state`` counts up to.
        last: the last action; None at first.
        repeats: how often in a row the last action was done.
    """

    start: AgentPose
    wanted: NDArray[np.float32] = field(default_factory=_nothing)
    seen: NDArray[np.bool_] = field(default_factory=_no_types)
    is_open: NDArray[np.bool_] = field(default_factory=_no_types)
    is_on: NDArray[np.bool_] = field(default_factory=_no_types)
    found: NDArray[np.float32] = field(default_factory=_nothing)
    did: NDArray[np.float32] = field(
        default_factory=lambda: np.zeros((len(verbs.OBJECT_VERBS), len(TYPES)), "f")
    )
    last: Action | None = None
    repeats: int = 0

    def look(self, perception: Perception, at: int | None = None) -> None:
        """Remember what is visible now; ``at`` is the type last navigated to."""
        objects, visible, seen = perception.objects, perception.visible, perception.visible_types
        self.seen |= seen
        out_of_sight = ~seen
        for remembered, state in ((self.is_open, "isOpen"), (self.is_on, "isToggled")):
            remembered &= out_of_sight
            for row, kind in _in_state(objects, state):
                if visible[row]:
                    remembered[kind] = True
        if at is not None:
            apart = {at, int(objects.kinds[objects.held]) if objects.held >= 0 else at}
            weights = [w for kind, w in self._goals if seen[kind] and kind not in apart]
            if weights:
                self.found[at] = max(self.found[at], *weights)

    @cached_property
    def _goals(self) -> list[tuple[int, np.float32]]:
        """The types with a weight, by number."""
        kinds = self.wanted.nonzero()[0]
        return list(zip(kinds.tolist(), self.wanted[kinds], strict=True))

    def forget_last(self) -> None:
        """Forget the last action: the next action then does not count as a repetition."""
        self.last, self.repeats = None, 0

    def state(self) -> dict[str, Any]:
        """All but the instruction's part, as plain data."""
        return {
            "start": list(astuple(self.start)),
            "arrays": [getattr(self, name).tobytes() for name in REMEMBERED],
            "last": self.last and [self.last.verb, self.last.object_type],
            "repeats": self.repeats,
        }

    @staticmethod
    def of_state(state: Mapping[str, Any], instruction: str) -> Memory:
        """The memory whose :meth:`state` this is."""
        memory = Memory(AgentPose(*state["start"]), goal_row(instruction))
        for name, content in zip(REMEMBERED, state["arrays"], strict=True):
            array = getattr(memory, name)
            array[:] = np.frombuffer(content, array.dtype).reshape(array.shape)
        memory.last = None if state["last"] is None else Action(*state["last"])
        memory.repeats = state["repeats"]
        return memory

    def act(self, action: Action, success: bool) -> None:
        """Remember an action that the agent did or tried."""
        self.repeats = self.repeats + 1 if action == self.last else 1
        self.last = action
        if success and action.object_type:
            row = verbs.OBJECT_VERBS.index(action.verb)
            kind = KIND_OF[action.object_type]
            self.did[row, kind] = min(self.did[row, kind] + 1 / _OFTEN, 1.0)


def _in_state(objects: ObjectTable, state: str) -> list[tuple[int, int]]:
    """The row and the type of each object that is in a state; found once for each table."""
    found = objects.derived.get(state)
    if not isinstance(found, list):
        rows = objects.has[state].nonzero()[0]
        found = objects.derived[state] = list(
            zip(rows.tolist(), objects.kinds[rows].tolist(), strict=True)
        )
    return found
