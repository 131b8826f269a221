"""The table of task types, one row for each; no other file states facts about single types.

Names, groups and step limits are the paper's (Embodied-Reasoner, arXiv 2503.21696).

Other packages add rows (``docs/extending.md``): what :func:`register` returns, named in the
environment variable ``ER_GYM_PLUGINS`` or by entry points in the group ``er_gym.task_types``.
``import er_gym`` looks for them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import lru_cache
from typing import Protocol

from er_gym.plugins import PluginError, added_objects

SEARCH, MANIPULATE, TRANSPORT, COMPOSITE = "Search", "Manipulate", "Transport", "Composite"
GROUPS = (SEARCH, MANIPULATE, TRANSPORT, COMPOSITE)
"""The groups, in the order of the paper's result table."""


class GenerationRule(Protocol):
    """A rule that generates tasks: an :class:`~er_gym.tasks.generate.task_plan.TaskRule`.

    The table knows nothing else about rules, since rules are made from the table's types.
    """

    @property
    def type(self) -> str:
        """The name of the type that it generates."""


@dataclass(frozen=True)
class TaskType:
    """A kind of task.

    Attributes:
        name: the name in the paper's task files (``tasktype``).
        title: the name in the paper's text.
        group: one of :data:`GROUPS`.
        env_id: the Gymnasium id of the environment with tasks of this type.
        max_steps: an episode's step limit; placing the agent counts as the first step.
        ordered: whether key actions count only in the order in which they are listed.
        search: whether the task is a search: on ``end`` the target must be within reach.
        rules: how tasks of a type that another package adds are generated; er-gym's own rules are in
            :mod:`er_gym.tasks.generate`.
    """

    name: str
    title: str
    group: str
    env_id: str
    max_steps: int
    ordered: bool = False
    search: bool = False
    rules: tuple[GenerationRule, ...] = field(default=(), compare=False, repr=False)

    def __reduce__(self) -> tuple[Callable[[str], TaskType], tuple[str]]:
        # Unpickled in another process, a row is that row of the table again.
        return task_type, (self.name,)


# fmt: off
TASK_TYPES = (
    TaskType("single_search", "Exposed Object Search", SEARCH, "ER-SingleSearch-v0", 22, search=True),
    TaskType("single_search_from_closerep", "Enclosed Object Search", SEARCH, "ER-SingleSearchFromCloserep-v0", 22, search=True),
    TaskType("single_pickup", "Exposed Object Grasping", MANIPULATE, "ER-SinglePickup-v0", 24),
    TaskType("single_pickup_from_closerep", "Enclosed Object Grasping", MANIPULATE, "ER-SinglePickupFromCloserep-v0", 24),
    TaskType("single_toggle", "Exposed Object Toggle", MANIPULATE, "ER-SingleToggle-v0", 24),
    TaskType("pickup_and_put", "Exposed-to-Exposed Object Transfer", TRANSPORT, "ER-PickupAndPut-v0", 30),
    TaskType("pickup_and_put_in_closerep", "Exposed-to-Enclosed Object Transfer", TRANSPORT, "ER-PickupAndPutInCloserep-v0", 30),
    TaskType("pickup_from_closerep_and_put", "Enclosed-to-Exposed Object Transfer", TRANSPORT, "ER-PickupFromCloserepAndPut-v0", 30),
    TaskType("pickup_from_closerep_and_put_in_closerep", "Enclosed-to-Enclosed Object Transfer", TRANSPORT, "ER-PickupFromCloserepAndPutInCloserep-v0", 30),
    TaskType("ordered_pickup_two_object_and_put", "Sequential Object Transfer", COMPOSITE, "ER-OrderedPickupTwoObjectAndPut-v0", 36, ordered=True),
    TaskType("long-range tasks with dependency relationships", "Long-Range Task with Dependencies", COMPOSITE, "ER-LongRange-v0", 36),
)
# fmt: on
"""The rows that come with er-gym."""

BY_NAME = {task_type.name: task_type for task_type in TASK_TYPES}
"""Every row. The rows of other packages come last."""
BY_ENV_ID = {task_type.env_id: task_type for task_type in TASK_TYPES}
_listeners: list[Callable[[TaskType], None]] = []
_ENV_ID = re.compile(r"[\w.-]+-v\d+")


def listen(tell: Callable[[TaskType], None]) -> None:
    """Call ``tell`` now with every present row, and later with every row as it is added."""
    for row in tuple(BY_NAME.values()):
        tell(row)
    _listeners.append(tell)


def register(row: TaskType) -> TaskType:
    """Add a type of task in this process, with its Gymnasium id; repeating this is harmless.

    Raises:
        PluginError: the row cannot be used; the message says why.
    """
    known = BY_NAME.get(row.name)
    if known is not None and (known, known.rules) == (row, row.rules):
        return known
    problem = _problem(row)
    if problem:
        raise PluginError(f"task type {row.name!r}: {problem}")
    BY_NAME[row.name] = BY_ENV_ID[row.env_id] = row
    _by_key.cache_clear()
    for tell in _listeners:
        tell(row)
    return row


def load_added() -> None:
    """Register the rows of other packages.

    Raises:
        PluginError: a row cannot be loaded or used.
    """
    expected = f"an {__name__}.TaskType"
    for found, origin in added_objects("task type", "task_types", expected, registers=True):
        if not isinstance(found, TaskType):
            raise PluginError(f"{origin} is {found!r}; give {expected}")
        register(found)


def _problem(row: TaskType) -> str:
    """The first problem of a row, "" if there is none."""
    for name in ("name", "title", "env_id"):
        text = getattr(row, name)
        if not isinstance(text, str) or not text.strip() or not text.isprintable():
            return f"{name} is {text!r}; give a line of text"
    if not _ENV_ID.fullmatch(row.env_id):
        return f"env_id is {row.env_id!r}; give one such as 'My-Task-v0'"
    for name in (row.name, row.env_id):
        if any(key in _by_key() for key in _keys(name)):
            return f"{name!r} is the name of another type; choose another"
    if row.group not in GROUPS:
        return f"group is {row.group!r}; choose one of: {', '.join(GROUPS)}"
    if not isinstance(row.max_steps, int) or isinstance(row.max_steps, bool) or row.max_steps < 2:
        return f"max_steps is {row.max_steps!r}; give a whole number from 2"
    others = [each for each in row.rules if getattr(each, "type", None) != row.name]
    if others:
        return f"a rule that generates tasks is {others[0]!r}; give a TaskRule of type {row.name!r}"
    return ""


# -- names -----------------------------------------------------------------------------------------

_GROUP_WORDS = {MANIPULATE: ("Manipulation",), TRANSPORT: ("Transportation",)}
"""What people also call a group."""
_VERSION = re.compile(r"-v\d+$")
_LONGEST = 80
_WORD = re.compile(r"[^\W_]+")
_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def short_name(row: TaskType) -> str:
    """A type's environment id without what all of them have, in lower case: ``long_range``."""
    bare = _VERSION.sub("", row.env_id.removeprefix("ER-"))
    return "_".join(_WORD.findall(_HUMP.sub(" ", bare))).lower()


def task_type(name: str) -> TaskType:
    """Look up a task type by any of its names (:func:`types_named`).

    Raises:
        ValueError: there is no such type, and the message lists the known types; or the name is
            that of a group.
    """
    found = BY_NAME.get(name) or BY_ENV_ID.get(name) if isinstance(name, str) else None
    if found is not None:
        return found
    several = _types_of(name)
    if len(several) > 1:
        raise ValueError(
            f"{name!r} names a group of {len(several)} types; give one of: "
            f"{', '.join(each.name for each in several)}"
        )
    return several[0]


def types_named(names: Iterable[str]) -> tuple[TaskType, ...]:
    """The types that some names mean, each once, in the order of the names.

    A name is the paper's in its task files (``single_search``), the title in its text, the
    environment id with or without ``ER-`` and ``-v0`` (``LongRange``, ``long_range``), or that of a
    group, which stands for its types. Upper and lower case, hyphens, underscores, spaces and a
    plural make no difference.

    Raises:
        ValueError: there is no such type or group; the message lists the known ones.
    """
    return tuple(dict.fromkeys(row for name in names for row in _types_of(name)))


def canonical_names(names: Iterable[str]) -> tuple[str, ...]:
    """The names in the paper's task files of what :func:`types_named` finds."""
    return tuple(row.name for row in types_named(names))


def shares_by_name(shares: Mapping[str, int]) -> dict[str, int]:
    """Whole numbers by type, where the keys are any names.

    The number of a group is divided evenly among its types; the first types get the remainder.

    Raises:
        ValueError: a name is unknown, or two name the same type.
    """
    found: dict[str, int] = {}
    for name, number in shares.items():
        rows = _types_of(name)
        for place, row in enumerate(rows):
            if row.name in found:
                raise ValueError(f"{name!r} names {row.name}, which has a number already")
            found[row.name] = number // len(rows) + (place < number % len(rows))
    return found


def _types_of(name: object) -> tuple[TaskType, ...]:
    keys = _keys(name) if isinstance(name, str) else ()
    found = next((_by_key()[key] for key in keys if key in _by_key()), None)
    if found is None:
        raise ValueError(_unknown(name))
    return found


def _unknown(name: object) -> str:
    spelled = {
        key: row.name for row in BY_NAME.values() for each in _names_of(row) for key in _keys(each)
    }
    spelled |= {key: group for group in GROUPS for key in _keys(group)}
    near = get_close_matches(_keys(str(name))[0][:_LONGEST], spelled, n=5)
    meant = list(dict.fromkeys(spelled[each] for each in near))[:3]
    hint = f" (did you mean {' or '.join(meant)}?)" if meant else ""
    return (
        f"unknown task type {name!r:.80}{hint}; choose one of: {', '.join(BY_NAME)}; or a group: "
        f"{', '.join(GROUPS)}"
    )


def _names_of(row: TaskType) -> tuple[str, ...]:
    bare = _VERSION.sub("", row.env_id)
    return row.name, row.env_id, row.title, row.env_id.removeprefix("ER-"), bare, short_name(row)


@lru_cache(maxsize=1)
def _by_key() -> dict[str, tuple[TaskType, ...]]:
    """The types that each name means, by what is left of a name if spelling does not matter."""
    names: dict[str, tuple[TaskType, ...]] = {}
    # No two types share the first two names; of types that share another, the first one has it.
    for own in (slice(2), slice(2, None)):
        for row in BY_NAME.values():
            for key in (key for each in _names_of(row)[own] for key in _keys(each)):
                names.setdefault(key, (row,))
    for group in GROUPS:
        rows = tuple(row for row in BY_NAME.values() if row.group == group)
        for word in (group, *_GROUP_WORDS.get(group, ())):
            names |= dict.fromkeys(_keys(word), rows)
    return names


def _keys(name: str) -> tuple[str, str]:
    """A name without what may be spelled differently, as it is and with its words in singular."""
    words = _WORD.findall(_HUMP.sub(" ", name).lower())
    return "".join(words), "".join(map(_singular, words))


def _singular(word: str) -> str:
    if word.endswith("ies"):
        return f"{word[:-3]}y"
    return word[:-1] if word.endswith("s") and not word.endswith("ss") else word
