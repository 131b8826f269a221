"""What the families make of a room, and what becomes a task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from er_gym.tasks import verbs
from er_gym.tasks.generate.room import Thing
from er_gym.tasks.task import KeyAction


@dataclass(frozen=True)
class Plan:
    """How a task is done, what it handles (its subject first), and words for its instruction."""

    key_actions: tuple[KeyAction, ...]
    handled: tuple[Thing, ...]
    words: Mapping[str, str]

    @property
    def names_one_place_each(self) -> bool:
        """Whether no type stands for two objects among those that the plan acts on."""
        named = {(action.object_type, action.object_id) for action in self.key_actions}
        return len(named) == len({object_type for object_type, _ in named})


def make_plan(actions: Sequence[KeyAction], handled: Sequence[Thing], **words: str) -> Plan:
    """A plan of these actions, which ``end`` follows, and of these words beside the usual ones."""
    involved = dict.fromkeys(chain.from_iterable(action.related_objects for action in actions))
    end = KeyAction(verbs.END, related_objects=tuple(involved))
    return Plan((*actions, end), tuple(handled), words)
