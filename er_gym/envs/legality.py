"""Which objects the agent may navigate to and interact with now: the paper's rules.

The functions judge all objects of an :class:`~er_gym.thor.objects.ObjectTable` at once. They name
an object by its row there. Positions are metres in AI2-THOR's world frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from er_gym.envs import feedback_words
from er_gym.envs.actions import ACTIONS, INDEX, INDICES, Action, applies
from er_gym.envs.perception import Perception, type_mask, type_names
from er_gym.tasks import verbs
from er_gym.tasks.verbs import Verb
from er_gym.thor.objects import KIND_OF, PROPERTY_OF_STATE, TYPES, ObjectTable

_FACES, _WITHIN_BY_FACE = (0.08, 0.15, 0.5), np.array([1.0, 2.5, 4.0, 10.0])
_VOLUMES, _WITHIN_BY_VOLUME = (0.001, 0.005), np.array([1.0, 1.5, 2.0])
_VOLUME_PER_METRE = 0.02


def navigable_within(volume: NDArray[np.float64], face: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) the distance below which the agent may go to a visible object, metres.

    The paper's rule: a visible object is clearly visible if d < 1, or S > 0.5 and d < 10, or
    S > 0.15 and d < 4, or S > 0.08 and d < 2.5, or V > 0.005 and d < 2, or V > 0.001 and d < 1.5,
    or V / d > 0.02 (with V at least 0.01; for a smaller V this means d < 0.5).

    Args:
        volume: (N,) V, the volume of each object's axis-aligned box, m³.
        face: (N,) S, the area of the box's largest face, m². In the rule, d is the horizontal
            distance from the agent to the box's centre, m.
    """
    # searchsorted counts the bounds that are less than a value.
    within = np.maximum(
        _WITHIN_BY_FACE[np.searchsorted(_FACES, face)],
        _WITHIN_BY_VOLUME[np.searchsorted(_VOLUMES, volume)],
    )
    return np.asarray(np.maximum(within, volume / _VOLUME_PER_METRE))


def _of_type(object_types: Iterable[str]) -> NDArray[np.bool_]:
    return type_mask(np.array([KIND_OF[name] for name in object_types], np.intp))


_INTERACTIONS = tuple(map(verbs.verb_named, verbs.INTERACTIONS))
_NUMBER = {verb.name: number for number, verb in enumerate(_INTERACTIONS)}
_INDICES = np.stack([INDICES[verb.name] for verb in _INTERACTIONS], axis=1)
_TAKES = {verb.name: _of_type(filter(verb.takes, TYPES)) for verb in _INTERACTIONS}
_ALSO = {verb.name: _of_type(verb.object_types) for verb in _INTERACTIONS}
_IN_HAND = [_NUMBER[verb.name] for verb in _INTERACTIONS if verb.in_hand]
_BARE = [INDEX[Action(verb)] for verb in verbs.BARE_VERBS]
_BARE_WITH_HAND = [
    verb for verb in map(verbs.verb_named, verbs.BARE_VERBS) if verb.hand != verbs.ANY
]
_BURNER = _of_type(["StoveBurner"])
TOGGLE_BURNER = INDEX[Action(verbs.TOGGLE, "StoveBurner")]
_NO_GOAL = _of_type(verbs.NOWHERE)


_FLAGS = tuple(dict.fromkeys((*PROPERTY_OF_STATE, *PROPERTY_OF_STATE.values()))) + tuple(
    verb.object_property for verb in _INTERACTIONS if verb.object_property
)
_ROW = {name: row for row, name in enumerate(_FLAGS)}
_ANY = _FLAGS[0]
_BY_PROPERTY = np.array([bool(verb.object_property) for verb in _INTERACTIONS])[:, None]
_BY_STATE = np.array([verb.object_state is not None for verb in _INTERACTIONS])[:, None]
_PROPERTY = [_ROW[verb.object_property or _ANY] for verb in _INTERACTIONS]
_STATE, _WANTED = zip(*(verb.object_state or (_ANY, True) for verb in _INTERACTIONS), strict=True)
_ABLE_TO = [_ROW[PROPERTY_OF_STATE[name]] for name in _STATE]
_IN_STATE, _AS_WANTED = [_ROW[name] for name in _STATE], np.array(_WANTED)[:, None]
_BY_TYPE = np.stack(
    [_ALSO[verb.name] if verb.object_property else _TAKES[verb.name] for verb in _INTERACTIONS]
)


def _possible(table: ObjectTable) -> NDArray[np.bool_]:
    """(len(INTERACTIONS), N) bool: the objects that each verb can apply to in their present state,
    for any hand."""
    flags = np.array([table.has[name] for name in _FLAGS])
    able = flags[_PROPERTY] & _BY_PROPERTY
    able |= _BY_TYPE[:, table.kinds]
    fitting = flags[_IN_STATE] == _AS_WANTED
    fitting |= ~flags[_ABLE_TO]
    fitting |= ~_BY_STATE
    return np.asarray(able & fitting)


def _hand_fits(verb: Verb, table: ObjectTable) -> bool:
    """Whether the hand holds what a verb needs."""
    if verb.hand == verbs.ANY:
        return True
    if verb.hand in (verbs.EMPTY, verbs.FULL):
        return (table.held < 0) == (verb.hand == verbs.EMPTY)
    return table.held >= 0 and table.type_of(table.held) in verb.hand


def _hand_problem(action: Action, verb: Verb, table: ObjectTable) -> str:
    """Why the hand does not fit a verb, in words for the agent."""
    if verb.hand == verbs.EMPTY:
        return feedback_words.HAND_FULL(thing=table.type_of(table.held))
    if verb.hand == verbs.FULL:
        return feedback_words.HAND_EMPTY()
    tools = " or ".join(f"{'an' if name[0] in 'AEIOU' else 'a'} {name}" for name in verb.hand)
    return feedback_words.NO_TOOL(action=action, tool=verb.tool or tools, tools=tools)


@dataclass(frozen=True, eq=False)
class Affordances:
    """What the agent could do with the N objects of a table from anywhere.

    Attributes:
        within: (N,) metres, see :func:`navigable_within`; 0 for the held object and the floor.
        actions: (N, len(INTERACTIONS)) the index of the action that applies each verb to each
            object; -1 if the state of the object or of the hand does not allow it.
        on_burners: (2, C) the rows of the objects on stove burners, and the row of each one's
            burner.
        alike: row of a receptacle to (N,) bool: the objects of the types that lie in it, without
            the floor and the held object. Computed on demand.
    """

    within: NDArray[np.float64]
    actions: NDArray[np.intp]
    on_burners: NDArray[np.intp]
    alike: dict[int, NDArray[np.bool_]] = field(default_factory=dict)

    @staticmethod
    def of(table: ObjectTable) -> Affordances:
        """Compute the affordances of a table."""
        within = navigable_within(table.volume, table.face)
        within[_NO_GOAL[table.kinds]] = 0.0
        possible = _possible(table)
        possible[[not _hand_fits(verb, table) for verb in _INTERACTIONS]] = False
        if table.held >= 0:
            within[table.held] = 0.0
        return Affordances(
            within=within,
            actions=np.where(possible.T, _INDICES[table.kinds], -1),
            on_burners=_on_burners(table),
        )


def _on_burners(table: ObjectTable) -> NDArray[np.intp]:
    burners = np.flatnonzero(_BURNER[table.kinds]).tolist()
    pairs = [(row, burner) for burner in burners for row in table.contents[burner]]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2).T


def affordances(table: ObjectTable) -> Affordances:
    """The affordances of a table's objects, computed once and stored with the table."""
    found = table.derived.get("affordances")
    if not isinstance(found, Affordances):
        found = table.derived["affordances"] = Affordances.of(table)
    return found


@dataclass(frozen=True, eq=False)
class AvailableObjects:
    """The objects that the agent can act on now.

    Attributes:
        objects: all objects of the scene.
        navigable: rows of the objects that the agent sees clearly enough to navigate to them.
        interactable: rows of the objects that the agent may interact with, the navigable included.
        covered: rows of the stove burners under an interactable object. The agent can turn the knob
            of such a burner even if a pan hides the burner.
    """

    objects: ObjectTable
    navigable: NDArray[np.intp]
    interactable: NDArray[np.intp]
    covered: NDArray[np.intp]

    @cached_property
    def interactable_types(self) -> NDArray[np.bool_]:
        """(T,) bool: True for the types of the interactable objects."""
        return type_mask(self.objects.kinds[self.interactable])

    @cached_property
    def in_reach(self) -> tuple[str, ...]:
        """The names of these types, in alphabetical order."""
        return type_names(self.interactable_types)


def available_objects(perception: Perception, navigated_to: str = "") -> AvailableObjects:
    """The objects that the agent can navigate to and interact with.

    Args:
        perception: what the agent perceives now.
        navigated_to: id of the receptacle last navigated to. Objects of the types that lie in it
            can be interacted with wherever they are visible.
    """
    table, visible = perception.objects, perception.visible
    can = affordances(table)
    distance = np.hypot(
        table.centre[:, 0] - perception.pose.x, table.centre[:, 2] - perception.pose.z
    )
    plain = visible & (distance < can.within)
    alike = alike_objects(table, navigated_to)
    reach = plain if alike is None else plain | (visible & alike)
    navigable = plain.nonzero()[0]
    standing, burners = can.on_burners
    return AvailableObjects(
        objects=table,
        navigable=navigable,
        interactable=navigable if reach is plain else reach.nonzero()[0],
        covered=burners[reach[standing]],
    )


def alike_objects(table: ObjectTable, navigated_to: str) -> NDArray[np.bool_] | None:
    """(N,) bool: the objects of the types that lie in the receptacle last navigated to, without the
    floor and the held object; None if nothing lies in it."""
    row = table.row.get(navigated_to)
    if row is None or not table.contents[row]:
        return None
    can = affordances(table)
    alike = can.alike.get(row)
    if alike is None:
        kinds = type_mask(table.kinds[list(table.contents[row])])
        alike = can.alike[row] = kinds[table.kinds] & (can.within > 0)
    return alike


class KnownTypes:
    """The types that the agent may navigate to: all that were clearly visible in the episode.

    Attributes:
        names: the names of the types, in alphabetical order.
        types: (T,) bool: True for each of these types.
        legal: (len(ACTIONS),) int8: 1 for each action that is legal whatever is in reach: going to
            one of these types, and the actions that name no type.
    """

    def __init__(self, object_types: Iterable[str]) -> None:
        self._told = {*object_types} - verbs.NOWHERE  # tasks also name types that no scene has
        self.types = type_mask(np.array([KIND_OF[t] for t in self._told & KIND_OF.keys()], np.intp))
        self._update()

    def add(self, kinds: NDArray[np.intp]) -> None:
        """Add the types of objects that are clearly visible now, by index into ``TYPES``."""
        if not self.types[kinds].all():
            self.types[kinds] = True
            self._update()

    def _update(self) -> None:
        self._names = self._told.union(type_names(self.types))
        self.names = tuple(sorted(self._names))
        self.legal = np.zeros(len(ACTIONS), dtype=np.int8)
        self.legal[_BARE] = self.legal[INDICES[verbs.NAVIGATE][self.types]] = 1

    def __contains__(self, object_type: str) -> bool:
        return object_type in self._names


def candidate_rows(action: Action, available: AvailableObjects) -> list[int]:
    """The rows of the objects that an interaction can be done to now."""
    rows, held = available.interactable, available.objects.held
    if action.verb == verbs.TOGGLE and len(available.covered):
        rows = np.union1d(rows, available.covered)
    if held >= 0 and verbs.verb_named(action.verb).in_hand:
        rows = np.union1d(rows, [held])
    actions = affordances(available.objects).actions[rows, _NUMBER[action.verb]]
    index = INDEX.get(action)
    return [
        row
        for row, possible in zip(rows.tolist(), actions.tolist(), strict=True)
        if possible == index
    ]


def illegal_reason(action: Action, available: AvailableObjects, known: KnownTypes) -> str:
    """Why an action is illegal now, in words for the agent; ``""`` if it is legal."""
    name, objects = action.object_type, available.objects
    verb = verbs.verb_named(action.verb)
    if verb.alone:
        return "" if _hand_fits(verb, objects) else _hand_problem(action, verb, objects)
    if action.verb == verbs.NAVIGATE:
        if name in known:
            return ""
        return feedback_words.NOT_KNOWN(thing=name, places=_listing(known.names))
    if candidate_rows(action, available):
        return ""
    if applies(action.verb, name):
        if not _hand_fits(verb, objects):
            return _hand_problem(action, verb, objects)
        in_hand = verb.in_hand and objects.held >= 0 and objects.type_of(objects.held) == name
        if not available.interactable_types[KIND_OF[name]] and not in_hand:
            places = _listing(available.in_reach)
            return feedback_words.OUT_OF_REACH(action=action, places=places)
    why = verb.otherwise or feedback_words.WRONG_STATE()
    return feedback_words.NOT_FIT(action=action, why=why)


def legal_actions(available: AvailableObjects, known: KnownTypes) -> NDArray[np.int8]:
    """(len(ACTIONS),) int8: 1 for each action without an :func:`illegal_reason`."""
    legal, objects = known.legal.copy(), available.objects
    possible = affordances(objects).actions
    interactions = possible[available.interactable]
    legal[interactions[interactions >= 0]] = 1
    if len(available.covered):
        legal[TOGGLE_BURNER] = 1
    if _IN_HAND and objects.held >= 0:
        with_held = possible[objects.held, _IN_HAND]
        legal[with_held[with_held >= 0]] = 1
    for verb in _BARE_WITH_HAND:
        legal[INDEX[Action(verb.name)]] = _hand_fits(verb, objects)
    return legal


def _listing(object_types: Iterable[str]) -> str:
    return ", ".join(object_types) or "nothing"
