"""The action space: verbs, alone or with an object type; the same in every scene."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import gymnasium
import numpy as np
from numpy.typing import NDArray

from er_gym.envs.arguments import short_repr
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES


@dataclass(frozen=True)
class Action:
    """A high-level action.

    Attributes:
        verb: one of :data:`er_gym.tasks.verbs.BARE_VERBS` or ``OBJECT_VERBS``.
        object_type: an AI2-THOR object type for the latter, ``""`` for the former.
    """

    verb: str
    object_type: str = ""

    def __str__(self) -> str:
        """As the paper writes it: ``navigate to Fridge``, ``end``."""
        return f"{self.verb} {self.object_type}".rstrip()


AnyAction: TypeAlias = Action | str | int | np.integer[Any] | NDArray[np.integer[Any]]
"""What ``step`` accepts: an action, its text, or its index in :data:`ACTIONS`. The index may be an
array of one element, shape () or (1,), as learners' ``predict`` returns it."""
NO_ACTION = "(no action) "
"""A text that begins with this never names an action."""


def applies(verb: str, object_type: str) -> bool:
    """Whether a verb can apply to an object type in any scene and state."""
    return verbs.verb_named(verb).takes(object_type)


def _all_actions() -> Iterator[Action]:
    own = sorted(verbs.OWN, key=lambda verb: not verb.alone)
    for verb in (*own, *verbs.ADDED):  # the numbers of er-gym's own actions stay the same
        names = ("",) if verb.alone else filter(verb.takes, OBJECT_TYPES)
        yield from (Action(verb.name, name) for name in names)


ACTIONS: tuple[Action, ...] = tuple(_all_actions())
"""Every action; a discrete action is an index into this."""
INDEX: dict[Action, int] = {action: index for index, action in enumerate(ACTIONS)}
INDICES: dict[str, NDArray[np.intp]] = {
    verb: np.array([INDEX.get(Action(verb, name), -1) for name in OBJECT_TYPES])
    for verb in verbs.OBJECT_VERBS
}
"""Verb to (T,) the index of its action with each object type; -1 if the verb does not apply."""
_BY_TEXT = {str(action).lower(): action for action in ACTIONS}
_VERBS_LONGEST_FIRST = sorted(
    {*verbs.OBJECT_VERBS, *verbs.ALIASES}, key=len, reverse=True
)  # so that "put in" is tried before "put"


def parse(text: str) -> Action | None:
    """The action that a text names, None if it names no action. Case and spacing are ignored."""
    words = " ".join(text.lower().split())
    alone = _BY_TEXT.get(words) or _BY_TEXT.get(verbs.canonical_verb(words))
    if alone is not None:
        return alone
    for verb in _VERBS_LONGEST_FIRST:
        if words.startswith(f"{verb} "):
            return _BY_TEXT.get(f"{verbs.canonical_verb(verb)} {words[len(verb) + 1 :]}")
    return None


def parse_action(action: AnyAction) -> tuple[Action | None, str]:
    """The action that a value means (None if a text names no action), and its text.

    Raises:
        gymnasium.error.InvalidAction: see :func:`text_of`.
    """
    text = text_of(action)
    if isinstance(action, str | Action):
        return parse(text), text
    return ACTIONS[_index_of(action)], text


def text_of(action: AnyAction) -> str:
    """The text of an action.

    Raises:
        gymnasium.error.InvalidAction: the value is not an action, its text or its index.
    """
    if isinstance(action, str | Action):
        return str(action)
    index = _index_of(action)
    if 0 <= index < len(ACTIONS):
        return str(ACTIONS[index])
    raise gymnasium.error.InvalidAction(
        f"{short_repr(action)} is not an action: give an index from 0 to {len(ACTIONS) - 1} "
        "(an int or an array with one integer), an Action, or text such as 'navigate to Fridge'"
    )


def _index_of(action: object) -> int:
    """The index that a value stands for, -1 if it stands for none."""
    if isinstance(action, int | np.integer) and not isinstance(action, bool):
        return int(action)
    if isinstance(action, np.ndarray) and action.shape in ((), (1,)) and action.dtype.kind in "iu":
        return int(action.item())
    return -1
