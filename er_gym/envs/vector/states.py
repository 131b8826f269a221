"""The memories of many agents, and their observation ``state``, at once.

:class:`~er_gym.envs.memory.Memory` and ``state`` of one agent are the rule; here are the same
operations on arrays with a row for each agent.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.asked_goal import GOAL_VERBS, goal
from er_gym.envs.memory import REMEMBERED, Memory
from er_gym.envs.observations import (
    ASKED_ENTRIES,
    FEATURE_ROW,
    FEATURES,
    FIRST_DID,
    LAST_ENTRY,
    SCALARS,
    Situation,
    pose_and_episode,
)
from er_gym.envs.vector.legality import InRooms
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES, ObjectTable

_KEPT = (*REMEMBERED, "wanted")
"""The arrays of a memory."""


class Memories:
    """The memories of n agents, with their arrays in one each.

    Args:
        n: the number of agents.
    """

    def __init__(self, n: int) -> None:
        flags, weights = np.zeros((3, n, len(TYPES)), bool), np.zeros((2, n, len(TYPES)), "f")
        self.seen, self.is_open, self.is_on = flags
        self.found, self.wanted = weights
        self.did = np.zeros((n, len(verbs.OBJECT_VERBS), len(TYPES)), "f")
        self.asked = np.zeros((n, len(GOAL_VERBS)), "f")

    def adopt(self, row: int, memory: Memory, instruction: str) -> None:
        """Take in the memory of an episode that has begun; its arrays are parts of these now."""
        for name in _KEPT:
            array = getattr(self, name)
            array[row] = getattr(memory, name)
            setattr(memory, name, array[row])
        self.asked[row] = goal(instruction)[0]

    def look(
        self,
        agents: NDArray[np.intp],
        objects: Sequence[ObjectTable],
        at: Sequence[int | None],
        rooms: InRooms,
        visible: NDArray[np.bool_],
    ) -> None:
        """Remember what p agents see now.

        Args:
            agents: (p,) their rows here.
            objects: the objects of each one's room.
            at: the type that each last navigated to; None for none.
            rooms: the objects of all rooms.
            visible: (p, T) the types that each agent sees.
        """
        self.seen[agents] |= visible
        in_sight, whose = rooms.visible.nonzero()[0], agents[rooms.room]
        for remembered, state in ((self.is_open, "isOpen"), (self.is_on, "isToggled")):
            remembered[agents] &= ~visible
            now = np.concatenate([table.has[state] for table in objects])
            rows = in_sight[now[in_sight]]
            remembered[whose[rows], rooms.kinds[rows]] = True
        there = [k for k, kind in enumerate(at) if kind is not None]
        if there:
            kinds = np.array([at[k] for k in there], np.intp)
            weights = self.wanted[agents[there]] * visible[there]
            weights[np.arange(len(there)), kinds] = 0.0
            for row, k in enumerate(there):
                if objects[k].held >= 0:
                    weights[row, objects[k].kinds[objects[k].held]] = 0.0
            best = weights.max(axis=1)
            place = agents[there], kinds
            self.found[place] = np.maximum(self.found[place], best)


def fill_states(
    vectors: NDArray[np.float32],
    memories: Memories,
    agents: NDArray[np.intp],
    situations: Sequence[Situation],
) -> None:
    """Fill in the observation ``state`` of k agents.

    Args:
        vectors: (k, D) of zeros.
        memories: of all agents.
        agents: (k,) the rows there of these.
        situations: of each.
    """
    scalars = np.array([pose_and_episode(situation) for situation in situations], np.float32)
    np.clip(scalars, -1.0, 1.0, out=vectors[:, : scalars.shape[1]])
    vectors[:, ASKED_ENTRIES] = memories.asked[agents]
    table = vectors[:, len(SCALARS) :].reshape(len(agents), len(FEATURES), len(TYPES))
    table[:, FEATURE_ROW["visible"]] = [each.perception.visible_types for each in situations]
    table[:, FEATURE_ROW["seen"]] = memories.seen[agents]
    table[:, FEATURE_ROW["navigable"]] = [each.known.types for each in situations]
    table[:, FEATURE_ROW["interactable"]] = [
        each.available.interactable_types for each in situations
    ]
    table[:, FEATURE_ROW["open"]] = memories.is_open[agents]
    table[:, FEATURE_ROW["on"]] = memories.is_on[agents]
    table[:, FEATURE_ROW["goal"]] = memories.wanted[agents]
    table[:, FEATURE_ROW["found"]] = memories.found[agents]
    table[:, FIRST_DID:] = memories.did[agents]
    for k, situation in enumerate(situations):
        last, objects = situation.memory.last, situation.perception.objects
        if last is not None:
            vectors[k, LAST_ENTRY[last.verb]] = 1.0
            if last.object_type in KIND_OF:
                table[k, FEATURE_ROW["last"], KIND_OF[last.object_type]] = 1.0
        if objects.held >= 0:
            table[k, FEATURE_ROW["held"], objects.kinds[objects.held]] = 1.0
        if situation.at is not None:
            table[k, FEATURE_ROW["at"], situation.at] = 1.0
