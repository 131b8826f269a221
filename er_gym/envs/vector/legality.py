"""What many agents can act on now, computed at once: :mod:`er_gym.envs.legality` for p rooms.

The objects of all rooms stand one after the other in arrays of M rows. Everything that a room's
state alone decides is its table's (:func:`er_gym.envs.legality.affordances`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.actions import ACTIONS
from er_gym.envs.legality import (
    TOGGLE_BURNER,
    AvailableObjects,
    KnownTypes,
    affordances,
    alike_objects,
    legal_actions,
)
from er_gym.envs.perception import Perception
from er_gym.tasks import verbs
from er_gym.thor.objects import TYPES

_HAND_DECIDES = any(verb.in_hand for verb in map(verbs.verb_named, verbs.INTERACTIONS)) or any(
    verbs.verb_named(verb).hand != verbs.ANY for verb in verbs.BARE_VERBS
)
"""Whether a verb of another package is legal by the hand alone: masks are then made one by one."""


@dataclass(frozen=True, eq=False)
class InRooms:
    """What p agents perceive, with the objects of all rooms in one row after the other.

    Attributes:
        room: (M,) whose object each is, 0 to p - 1.
        first: (p + 1,) where the objects of each room begin, and M.
        kinds: (M,) index of the type in ``TYPES``.
        visible: (M,) bool.
        navigable, interactable: (M,) bool, see :class:`~er_gym.envs.legality.AvailableObjects`.
    """

    room: NDArray[np.intp]
    first: NDArray[np.intp]
    kinds: NDArray[np.intp]
    visible: NDArray[np.bool_]
    navigable: NDArray[np.bool_]
    interactable: NDArray[np.bool_]

    @staticmethod
    def of(perceptions: Sequence[Perception], navigated_to: Sequence[str]) -> InRooms:
        """The objects of p rooms; ``navigated_to`` as for one room."""
        tables = [perception.objects for perception in perceptions]
        sizes = [len(table) for table in tables]
        first = np.concatenate([[0], np.cumsum(sizes)])
        visible = np.concatenate([perception.visible for perception in perceptions])
        poses = np.array([(seen.pose.x, seen.pose.z) for seen in perceptions])
        centre = np.concatenate([table.centre for table in tables])
        room = np.repeat(np.arange(len(tables)), sizes)
        offset = centre[:, ::2] - poses[room]
        within = np.concatenate([affordances(table).within for table in tables])
        navigable = visible & (np.hypot(offset[:, 0], offset[:, 1]) < within)
        interactable = navigable
        for k, (table, goal) in enumerate(zip(tables, navigated_to, strict=True)):
            alike = alike_objects(table, goal)
            if alike is not None:
                if interactable is navigable:
                    interactable = navigable.copy()
                mine = slice(first[k], first[k + 1])
                interactable[mine] |= visible[mine] & alike
        kinds = np.concatenate([table.kinds for table in tables])
        return InRooms(room, first, kinds, visible, navigable, interactable)

    def types(self, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(p, T) the types of the chosen objects in each room."""
        found = np.zeros((len(self.first) - 1, len(TYPES)), dtype=bool)
        found[self.room[chosen], self.kinds[chosen]] = True
        return found

    def rows(self, chosen: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
        """For each room the rows of the chosen objects in its table."""
        places = chosen.nonzero()[0]
        local = places - self.first[self.room[places]]
        ends = np.searchsorted(places, self.first).tolist()
        return [local[begin:end] for begin, end in pairwise(ends)]


def available_together(perceptions: Sequence[Perception], rooms: InRooms) -> list[AvailableObjects]:
    """The objects that each agent can act on."""
    navigable = rooms.rows(rooms.navigable)
    same = rooms.interactable is rooms.navigable
    interactable = navigable if same else rooms.rows(rooms.interactable)
    types = rooms.types(rooms.interactable)
    available = []
    for k, perception in enumerate(perceptions):
        standing, burners = affordances(perception.objects).on_burners
        covered = burners
        if len(burners):
            covered = burners[rooms.interactable[rooms.first[k] + standing]]
        each = AvailableObjects(perception.objects, navigable[k], interactable[k], covered)
        each.__dict__["interactable_types"] = types[k]  # so that it need not be computed again
        available.append(each)
    return available


def legal_together(
    available: Sequence[AvailableObjects], known: Sequence[KnownTypes], rooms: InRooms
) -> NDArray[np.int8]:
    """(p, len(ACTIONS)) int8: 1 for each action that is legal."""
    if _HAND_DECIDES:
        pairs = zip(available, known, strict=True)
        return np.stack([legal_actions(one, types) for one, types in pairs])
    legal = np.stack([types.legal for types in known])
    possible = np.concatenate([affordances(one.objects).actions for one in available])
    reach = rooms.interactable.nonzero()[0]
    actions = possible[reach]
    allowed = actions >= 0
    places = actions + (rooms.room[reach] * len(ACTIONS))[:, None]
    legal.reshape(-1)[places[allowed]] = 1
    for k, one in enumerate(available):
        if len(one.covered):
            legal[k, TOGGLE_BURNER] = 1
    return legal
