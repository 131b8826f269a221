"""Faults: actions that go wrong once, as those of a real robot do.

A fault is injected into a legal action before it is carried out. ``navigate to`` arrives at another
place; in an interaction the arm fails and nothing changes. The action counts as not done, and the
feedback describes the result in words. An agent can thus notice the fault and try again.

Rules:

- Each action of a kind goes wrong with the probability that the rates give for the kind.
- After two faults in a row, the same action is carried out. Other actions in between do not count,
  so the third try is always carried out, at any rate of faults.
- What goes wrong depends only on the seed of the episode, on the rates, and on the actions taken.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from er_gym.envs import feedback_words
from er_gym.envs.action_handler import ActionHandler, ExecutedAction, StepContext
from er_gym.envs.actions import Action
from er_gym.envs.arguments import number, short_repr
from er_gym.envs.legality import AvailableObjects, KnownTypes
from er_gym.envs.perception import Perception
from er_gym.envs.skills import Outcome
from er_gym.envs.snapshot import generator_of, generator_state
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among
from er_gym.tasks.task import type_of_id
from er_gym.thor.objects import ObjectTable

NAVIGATE = "navigate"
KIND_OF_VERB: Mapping[str, str] = {
    verbs.NAVIGATE: NAVIGATE,
    verbs.OPEN: "open",
    verbs.CLOSE: "close",
    verbs.PICKUP: "pickup",
    verbs.PUT: "put",
    verbs.TOGGLE: "toggle",
}
"""The verbs that can go wrong, and the name of each one's fault."""
KINDS = tuple(KIND_OF_VERB.values())
"""The kinds of faults, as the environment's ``faults`` and ``info["fault"]`` name them."""
MOST_IN_A_ROW = 2
"""After this many faults in a row, the same action is carried out."""
_ARM_FAILED = {
    "open": feedback_words.FAULT_OPEN,
    "close": feedback_words.FAULT_CLOSE,
    "pickup": feedback_words.FAULT_PICKUP,
    "put": feedback_words.FAULT_PUT,
    "toggle": feedback_words.FAULT_TOGGLE,
}
_STREAM = 0xFA017
"""Sets the random numbers of faults apart from others that come from the same seed."""

FaultRates: TypeAlias = Mapping[str, float]
"""Kinds to the probability, in (0, 1], with which an action of the kind goes wrong."""
Faults: TypeAlias = float | Mapping[str, float]
"""What ``EmbodiedEnv(faults=…)`` takes: one rate for all kinds, or a rate for each kind."""


def fault_rates(faults: Any) -> dict[str, float]:
    """Check the rates of faults, and leave out those of 0; an empty answer means no faults.

    Args:
        faults: one rate in [0, 1] for all kinds, or a mapping of :data:`KINDS` to rates.

    Raises:
        ValueError: it is neither, or a rate is out of its range.
    """
    if isinstance(faults, Mapping):
        unknown = [kind for kind in faults if kind not in KINDS]
        if unknown:
            raise ValueError(
                f"unknown kind of fault {short_repr(unknown[0])}; there are: {', '.join(KINDS)}"
            )
        given = {kind: _rate(f"faults[{kind!r}]", faults[kind]) for kind in KINDS if kind in faults}
    elif isinstance(faults, Real):
        given = dict.fromkeys(KINDS, _rate("faults", faults))
    else:
        raise ValueError(
            f"faults is {short_repr(faults)}; give a rate from 0 to 1, or a rate for each kind, "
            f"such as {{'navigate': 0.2, 'open': 0.1}}; the kinds are: {', '.join(KINDS)}"
        )
    return {kind: rate for kind, rate in given.items() if rate}


def _rate(name: str, value: Any) -> float:
    return number(name, value, 0, 1, allowed="a rate from 0 to 1, such as 0.1")


def parse_faults(text: str) -> Faults:
    """The rates that a text states: ``0.1``, or ``navigate=0.2,open=0.1``; they are checked.

    A rate of 0 is left out, and 0 is returned if none is left.

    Raises:
        ValueError: the text states no rates.
    """
    if "=" not in text:
        single = _number_in(text, text)
        return single if fault_rates(single) else 0.0
    rates: dict[str, float] = {}
    for part in text.split(","):
        kind, equals, rate = (word.strip() for word in part.partition("="))
        if not equals:
            raise _no_rates(text)
        if kind in rates:
            raise ValueError(f"faults state a rate for {kind!r:.40} twice; give one")
        rates[kind] = _number_in(rate, text)
    return fault_rates(rates) or 0.0


def _number_in(word: str, text: str) -> float:
    try:
        return float(word)
    except ValueError:
        raise _no_rates(text) from None


def _no_rates(text: str) -> ValueError:
    return ValueError(
        f"{short_repr(text)} states no rates of faults; give a rate from 0 to 1, such as 0.1, or "
        f"KIND=RATE,… with the kinds: {', '.join(KINDS)}"
    )


@dataclass(frozen=True)
class FaultPlan:
    """How often actions go wrong, and the random numbers that decide when.

    Attributes:
        rates: checked, see :func:`fault_rates`.
        seed: whole numbers from 0: that of the episode, and perhaps one more.
    """

    rates: FaultRates
    seed: tuple[int, ...]

    def state(self) -> list[Any]:
        """Its rates and its seed, as plain data."""
        return [dict(self.rates), [str(number) for number in self.seed]]

    @staticmethod
    def of_state(state: Sequence[Any]) -> FaultPlan:
        """The plan whose :meth:`state` this is."""
        rates, seed = state
        return FaultPlan(fault_rates(rates), tuple(map(int, seed)))

    def handler(self, inner: ActionHandler, known: KnownTypes) -> FaultyActionHandler:
        """An action handler with these faults."""
        return FaultyActionHandler(
            inner, known, self.rates, np.random.default_rng((_STREAM, *self.seed))
        )


class FaultyActionHandler:
    """A protocol's action handler, some of whose legal actions go wrong.

    Args:
        inner: the protocol's.
        known: the types that the agent may navigate to; the episode adds to them.
        rates: see :class:`FaultPlan`.
        random: draws the faults.

    Attributes:
        fault: the kind of fault injected into the last action carried out, ``""`` for none.
    """

    def __init__(
        self,
        inner: ActionHandler,
        known: KnownTypes,
        rates: FaultRates,
        random: np.random.Generator,
    ) -> None:
        self.fault = ""
        self._inner, self._known, self._rates, self._random = inner, known, rates, random
        self._in_a_row: Counter[Action] = Counter()

    @property
    def navigated_to(self) -> str:
        """The id of the object last navigated to, ``""`` at first."""
        return self._inner.navigated_to

    def available_objects(self, perception: Perception) -> AvailableObjects:
        """The protocol's."""
        return self._inner.available_objects(perception)

    def illegal_reason(self, action: Action, available: AvailableObjects, known: KnownTypes) -> str:
        """The protocol's."""
        return self._inner.illegal_reason(action, available, known)

    def legal(self, available: AvailableObjects, known: KnownTypes) -> NDArray[np.int8]:
        """The protocol's."""
        return self._inner.legal(available, known)

    def execute(self, action: Action, now: StepContext) -> ExecutedAction:
        """Carry out a legal action, or let it go wrong.

        Where a navigation arrives elsewhere, the id is that of the object arrived at.
        """
        kind = KIND_OF_VERB.get(action.verb, "")
        goes_wrong = kind in self._rates and self._random.random() < self._rates[kind]
        if not goes_wrong or self._in_a_row[action] >= MOST_IN_A_ROW:
            self.fault = ""
            self._in_a_row[action] = 0
            return self._inner.execute(action, now)
        self.fault = kind
        self._in_a_row[action] += 1
        if kind == NAVIGATE:
            return self._arrive_elsewhere(action, now)
        return "", Outcome(None, False, _ARM_FAILED[kind]())

    def state(self) -> dict[str, Any]:
        """The protocol's, and which faults are still to come."""
        tries = [[each.verb, each.object_type, n] for each, n in self._in_a_row.items()]
        random = generator_state(self._random)
        return {"inner": self._inner.state(), "fault": self.fault, "tries": tries, "random": random}

    def restore(self, state: Mapping[str, Any]) -> None:
        """See :meth:`state`."""
        self._inner.restore(state["inner"])
        self.fault = state["fault"]
        self._in_a_row = Counter({Action(verb, kind): n for verb, kind, n in state["tries"]})
        self._random = generator_of(state["random"])

    def _arrive_elsewhere(self, action: Action, now: StepContext) -> ExecutedAction:
        objects = now.perception.objects
        places = other_places(action.object_type, self._known.names, objects, self.navigated_to)
        if not places:
            return "", Outcome(None, False, feedback_words.NOWHERE_ELSE())
        place = places[int(self._random.integers(len(places)))]
        object_id, arrived = self._inner.execute(Action(verbs.NAVIGATE, place), now)
        if not arrived.success:
            return "", replace(arrived, problem=feedback_words.NOWHERE_ELSE())
        return object_id, Outcome(arrived.perception, False, feedback_words.ASTRAY(thing=place))


def other_places(
    object_type: str, known: Sequence[str], objects: ObjectTable, at: str = ""
) -> list[str]:
    """The types that the agent could arrive at when it means to go to another.

    Types that lie in or on an object of the type meant, or hold one, are left out: to arrive there
    is to arrive. So are the held object, and the type of what the agent stands at.

    Args:
        object_type: the type meant.
        known: the types that the agent may navigate to.
        objects: all objects.
        at: the id of the object last navigated to, ``""`` for none.
    """
    goals = objects.of_type(object_type)
    near = {object_type, type_of_id(at)}
    for row in goals:
        near.update(objects.type_of(other) for other in objects.parents[row])
        near.update(objects.type_of(other) for other in objects.contents[row])
    if objects.held >= 0:
        near.add(objects.type_of(objects.held))
    return [name for name in known if objects.of_type(name) and not is_among(name, near)]
