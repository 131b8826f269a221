"""What may be navigated to and interacted with now: the paper's rules.

Whole columns of objects are judged at once (:class:`~er_gym.thor.objects.ObjectTable`); objects are
given by their rows there. Positions are metres in AI2-THOR's world frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.actions import ACTIONS, INDEX, INDICES, NOWHERE, Action, applies
from er_gym.envs.percept import Percept, marked, names
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.thor.objects import KIND_OF, ObjectTable

_FACES, _WITHIN_BY_FACE = (0.08, 0.15, 0.5), np.array([1.0, 2.5, 4.0, 10.0])
_VOLUMES, _WITHIN_BY_VOLUME = (0.001, 0.005), np.array([1.0, 1.5, 2.0])
_VOLUME_PER_METRE = 0.02


def navigable_within(volume: NDArray[np.float64], face: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) how near the agent must be to visible objects, metres, to walk to them: nearer than so.

    The paper's rule: an object is plain enough to see if d < 1, or S > 0.5 and d < 10, or S > 0.15
    and d < 4, or S > 0.08 and d < 2.5, or V > 0.005 and d < 2, or V > 0.001 and d < 1.5, or
    V / d > 0.02 (with V at least 0.01; less than that has d < 1 anyhow).

    Args:
        volume: (N,) V, of each one's axis-aligned box, m³.
        face: (N,) S, of the box's largest face, m². And d is the horizontal distance from the agent
            to the box's centre, m.
    """
    # searchsorted counts the bounds that are less than a value.
    within = np.maximum(
        _WITHIN_BY_FACE[np.searchsorted(_FACES, face)],
        _WITHIN_BY_VOLUME[np.searchsorted(_VOLUMES, volume)],
    )
    return np.asarray(np.maximum(within, volume / _VOLUME_PER_METRE))


@dataclass(frozen=True)
class _Condition:
    """Which objects a verb can be done to in their present state, and what to say of others."""

    holds: Callable[[ObjectTable], NDArray[np.bool_]]
    otherwise: str


def _of_type(*object_types: str) -> NDArray[np.bool_]:
    return marked(np.array([KIND_OF[name] for name in object_types]))


_HAS_BASIN = _of_type(*BASIN_OF)
_BURNER = _of_type("StoveBurner")
_KNIFE = _of_type("Knife", "ButterKnife")
_NO_GOAL = _of_type(*NOWHERE)
_CONDITIONS = {
    verbs.PICKUP: _Condition(lambda table: table.pickupable, "It cannot be picked up."),
    verbs.PUT: _Condition(
        lambda table: (
            (table.receptacle | _HAS_BASIN[table.kinds]) & (table.is_open | ~table.openable)
        ),
        "It is closed, or nothing can be put into it.",
    ),
    verbs.OPEN: _Condition(
        lambda table: table.openable & ~table.is_open, "It is open already, or does not open."
    ),
    verbs.CLOSE: _Condition(
        lambda table: table.openable & table.is_open, "It is closed already, or does not close."
    ),
    verbs.TOGGLE: _Condition(
        lambda table: table.toggleable | _BURNER[table.kinds], "It has no switch."
    ),
    verbs.SLICE: _Condition(lambda table: table.sliceable, "It cannot be sliced."),
}


def _empty(table: ObjectTable) -> bool:
    return table.held < 0


def _holds_knife(table: ObjectTable) -> bool:
    return table.held >= 0 and bool(_KNIFE[table.kinds[table.held]])


_HAND: Mapping[str, Callable[[ObjectTable], bool]] = {
    verbs.PICKUP: _empty,
    verbs.PUT: lambda table: not _empty(table),
    verbs.SLICE: _holds_knife,
}
"""What verbs ask of the hand."""
_BARE = [INDEX[Action(verb)] for verb in verbs.BARE_VERBS]
_NUMBER = {verb: number for number, verb in enumerate(verbs.INTERACTIONS)}
_TOGGLE_BURNER = INDEX[Action(verbs.TOGGLE, "StoveBurner")]
_INTERACTION_INDICES = np.stack([INDICES[verb] for verb in verbs.INTERACTIONS], axis=1)


@dataclass(frozen=True, eq=False)
class Affordances:
    """What could be done with the N objects of a table, wherever the agent is.

    Attributes:
        within: (N,) how near one must be to walk there, metres, see :func:`navigable_within`; 0 for
            what is in the hand, and for the floor.
        actions: (N, len(INTERACTIONS)) index of the action that does each verb to each object; -1
            where it cannot be done in the object's present state, and that of the hand.
        on_burners: (2, C) rows of what stands on a stove burner, and of the burner under each.
        alike: row of a receptacle to (N,) bool, which objects are of types that lie in it; less the
            floor and what is in the hand. Filled as it is asked for.
    """

    within: NDArray[np.float64]
    actions: NDArray[np.intp]
    on_burners: NDArray[np.intp]
    alike: dict[int, NDArray[np.bool_]] = field(default_factory=dict)

    @staticmethod
    def of(table: ObjectTable) -> Affordances:
        """Work them out."""
        within = navigable_within(table.volume, table.face)
        within[_NO_GOAL[table.kinds]] = 0.0
        possible = np.stack([_CONDITIONS[verb].holds(table) for verb in verbs.INTERACTIONS], axis=1)
        for verb, fits in _HAND.items():
            if not fits(table):
                possible[:, _NUMBER[verb]] = False
        if table.held >= 0:
            within[table.held] = 0.0
        return Affordances(
            within=within,
            actions=np.where(possible, _INTERACTION_INDICES[table.kinds], -1),
            on_burners=_on_burners(table),
        )


def _on_burners(table: ObjectTable) -> NDArray[np.intp]:
    burners = np.flatnonzero(_BURNER[table.kinds]).tolist()
    pairs = [(row, burner) for burner in burners for row in table.contents[burner]]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2).T


def affordances(table: ObjectTable) -> Affordances:
    """What could be done with a table's objects: worked out once, and kept with the table."""
    found = table.derived.get("affordances")
    if not isinstance(found, Affordances):
        found = table.derived["affordances"] = Affordances.of(table)
    return found


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What the agent can do things to, now.

    Attributes:
        objects: all of the scene.
        navigable: rows of objects that are plain enough to see to be walked to.
        interactable: rows of objects that may be interacted with; the navigable are among them.
        covered: rows of the stove burners that are under one of these. Whether a pan hides its
            burner or not, the knob of that burner can be turned.
    """

    objects: ObjectTable
    navigable: NDArray[np.intp]
    interactable: NDArray[np.intp]
    covered: NDArray[np.intp]

    @cached_property
    def interactable_types(self) -> NDArray[np.bool_]:
        """(T,) bool: the types of the interactable objects."""
        return marked(self.objects.kinds[self.interactable])

    @cached_property
    def in_reach(self) -> tuple[str, ...]:
        """The names of the same types, in alphabetical order."""
        return names(self.interactable_types)


def surroundings(percept: Percept, at: str = "") -> Surroundings:
    """Judge what is perceived.

    Args:
        at: id of the receptacle last navigated to. Things of the types that lie in it can be
            interacted with wherever they are visible.
    """
    table, visible = percept.objects, percept.visible
    can = affordances(table)
    distance = np.hypot(table.centre[:, 0] - percept.pose.x, table.centre[:, 2] - percept.pose.z)
    plain = visible & (distance < can.within)
    reach = plain
    row = table.row.get(at)
    if row is not None and table.contents[row]:
        alike = can.alike.get(row)
        if alike is None:
            kinds = marked(table.kinds[list(table.contents[row])])
            alike = can.alike[row] = kinds[table.kinds] & (can.within > 0)
        reach = plain | (visible & alike)
    navigable = plain.nonzero()[0]
    standing, burners = can.on_burners
    return Surroundings(
        objects=table,
        navigable=navigable,
        interactable=navigable if reach is plain else reach.nonzero()[0],
        covered=burners[reach[standing]],
    )


class Known:
    """The types that may be navigated to: what was plain to see once in an episode stays so.

    Attributes:
        names: theirs, in alphabetical order.
        types: (T,) bool, the same.
        legal: (len(ACTIONS),) int8, 1 for each action that is legal whatever is in reach: to go to
            one of these types, and those that name none.
    """

    def __init__(self, object_types: Iterable[str]) -> None:
        self._told = {*object_types} - NOWHERE  # tasks name types that no scene has, too
        self.types = marked(np.array([KIND_OF[t] for t in self._told & KIND_OF.keys()], np.intp))
        self._update()

    def add(self, kinds: NDArray[np.intp]) -> None:
        """Some objects are plain to see now, of these kinds."""
        if not self.types[kinds].all():
            self.types[kinds] = True
            self._update()

    def _update(self) -> None:
        self._names = self._told.union(names(self.types))
        self.names = tuple(sorted(self._names))
        self.legal = np.zeros(len(ACTIONS), dtype=np.int8)
        self.legal[_BARE] = self.legal[INDICES[verbs.NAVIGATE][self.types]] = 1

    def __contains__(self, object_type: str) -> bool:
        return object_type in self._names


def suited(action: Action, around: Surroundings) -> list[int]:
    """Rows of the objects that an interaction can be done to as things are now."""
    rows = around.interactable
    if action.verb == verbs.TOGGLE and len(around.covered):
        rows = np.union1d(rows, around.covered)
    actions = affordances(around.objects).actions[rows, _NUMBER[action.verb]]
    index = INDEX.get(action)
    return [
        row
        for row, possible in zip(rows.tolist(), actions.tolist(), strict=True)
        if possible == index
    ]


def objection(action: Action, around: Surroundings, known: Known) -> str:
    """Why an action is illegal now, in words for the agent; "" when it is legal."""
    name, held = action.object_type, around.objects.held
    if action.verb in verbs.BARE_VERBS:
        return ""
    if action.verb == verbs.NAVIGATE:
        if name in known:
            return ""
        return (
            f"You cannot navigate to {name}: none has been close enough to see clearly. "
            f"You could go to: {_listing(known.names)}."
        )
    if suited(action, around):
        return ""
    if applies(action.verb, name):
        if action.verb == verbs.PICKUP and held >= 0:
            return f"You hold {around.objects.type_of(held)} already; put it down first."
        if action.verb == verbs.PUT and held < 0:
            return "Your hand is empty; pick something up first."
        if action.verb == verbs.SLICE and not _holds_knife(around.objects):
            return (
                f"You cannot slice {name} without a knife in your hand; "
                "pick up a Knife or a ButterKnife first."
            )
        if not around.interactable_types[KIND_OF[name]]:
            return (
                f"You cannot {action.verb} {name}: none is within reach and in view. "
                f"There is: {_listing(around.in_reach)}."
            )
    return f"You cannot {action.verb} {name}. {_CONDITIONS[action.verb].otherwise}"


def legal_actions(around: Surroundings, known: Known) -> NDArray[np.int8]:
    """(len(ACTIONS),) int8: 1 for each action to which :func:`objection` has none."""
    legal = known.legal.copy()
    interactions = affordances(around.objects).actions[around.interactable]
    legal[interactions[interactions >= 0]] = 1
    if len(around.covered):
        legal[_TOGGLE_BURNER] = 1
    return legal


def _listing(object_types: Iterable[str]) -> str:
    return ", ".join(object_types) or "nothing"
