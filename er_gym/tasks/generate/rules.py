"""The table of what is generated, and the templates of instructions.

Templates may use {object}, {an_object} and {it} (the subject), {room} (its kind), and the words of
the rule's plans.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from er_gym.tasks.generate.composite import sequences, washes
from er_gym.tasks.generate.manipulate import pickups, toggles
from er_gym.tasks.generate.plan import Plan
from er_gym.tasks.generate.room import Room
from er_gym.tasks.generate.search import searches
from er_gym.tasks.generate.transport import transfer_plans
from er_gym.tasks.types import BY_NAME


@dataclass(frozen=True)
class Rule:
    """A row of the table.

    Attributes:
        type: a name in ``TASK_TYPES``.
        plans: all plans of that type for a room.
        templates: instructions; the first one words the task's name.
        slug: stands for the type in task ids, where its name is no good as a part of a file name
            or says too little; the type's name by default.
    """

    type: str
    plans: Callable[[Room], Iterable[Plan]]
    templates: tuple[str, ...]
    slug: str = ""


_FIND = (
    "Find the {object} in the {room}.",
    "Can you find {an_object} anywhere in this {room}?",
    "I have lost sight of the {object}. Please look around the {room} for {it}.",
    "There should be {an_object} in this {room}. Please go and look.",
)
_PICK_UP = (
    "Pick up the {object} in the {room}.",
    "Please fetch the {object}.",
    "I need {an_object} from this {room}. Could you get hold of {it} for me?",
    "Look around the {room} until you see the {object}, and take {it} in your hand.",
)
_TOGGLE = (
    "Turn {way} the {object} in the {room}.",
    "Please switch the {object} {way}.",
    "Would you turn the {object} {way} for me?",
    "Go over to the {object} and switch {it} {way}.",
)
_MOVE = (
    "Put the {object} {place}.",
    "Please take the {object} and put {it} {place}.",
    "I would like to have the {object} {place}. Can you see to that?",
    "Could you get the {object} and leave {it} {place}?",
)
_MOVE_TWO = (
    "First, put the {object} {place}; then, put the {second_object} {second_place}.",
    "Please put the {object} {place}, and after that put the {second_object} {second_place}.",
    "Two things, in this order: the {object} goes {place}, the {second_object} {second_place}.",
    "Once you have put the {object} {place}, could you put the {second_object} {second_place}?",
)
_WASH = (
    "Wash the {object} {basin} under the running {faucet}, then put {it} {place}.",
    "Please rinse the {object}: lay {it} {basin}, turn on the {faucet}, then put {it} {place}.",
    "I would like the {object} washed {basin}. Turn on the {faucet} for that, and put {it} {place}"
    " afterwards.",
    "Could you get the {object}, rinse {it} {basin} with water from the {faucet}, and leave {it}"
    " {place}?",
)


def _transfer_rule(type_name: str, hidden: bool, into_closed: bool) -> Rule:
    return Rule(type_name, partial(transfer_plans, hidden=hidden, into_closed=into_closed), _MOVE)


RULES = (
    Rule("single_search", partial(searches, hidden=False), _FIND),
    Rule("single_search_from_closerep", partial(searches, hidden=True), _FIND),
    Rule("single_pickup", partial(pickups, hidden=False), _PICK_UP),
    Rule("single_pickup_from_closerep", partial(pickups, hidden=True), _PICK_UP),
    Rule("single_toggle", toggles, _TOGGLE),
    _transfer_rule("pickup_and_put", hidden=False, into_closed=False),
    _transfer_rule("pickup_and_put_in_closerep", hidden=False, into_closed=True),
    _transfer_rule("pickup_from_closerep_and_put", hidden=True, into_closed=False),
    _transfer_rule("pickup_from_closerep_and_put_in_closerep", hidden=True, into_closed=True),
    Rule("ordered_pickup_two_object_and_put", sequences, _MOVE_TWO),
    Rule("long-range tasks with dependency relationships", washes, _WASH, slug="long_range_wash"),
)

GENERATED_TYPES = tuple(BY_NAME[name] for name in dict.fromkeys(rule.type for rule in RULES))
"""The task types that :func:`~er_gym.tasks.generate.generate_tasks` makes."""
