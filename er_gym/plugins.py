"""Plugins: objects that other packages add to er-gym, found by name.

There are two ways to name a plugin:

- ``package.module:Name``, a dotted name of an object in a module;
- the name of an entry point that an installed package declares in one of er-gym's groups, such as
  ``er_gym.agents``.

A :class:`Registry` looks a name up among er-gym's own objects, then in both of these ways.
Tables that are complete before anything is looked up (task types, verbs, actions and shapes) take
everything that :func:`added_objects` finds: what installed packages declare, and what the
environment variable ``ER_GYM_PLUGINS`` names, such as ``verbs=household.verbs:CLEAN``.
``docs/extending.md`` has a walk-through for each registry.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from importlib import import_module, metadata
from types import MappingProxyType, ModuleType
from typing import Any, Generic, TypeVar, cast

T = TypeVar("T")


class PluginError(ValueError):
    """A name does not stand for a usable plugin; the message says why and what is allowed."""


class NotImported(PluginError):
    """A name is spelled as it should be, and what it stands for was not to be imported."""


VARIABLE = "ER_GYM_PLUGINS"
"""The environment variable that names rows of tables: ``TABLE=package.module:Name``, with commas
between them."""
TABLES = ("task_types", "verbs", "actions", "shapes")
"""The tables that the variable may name; ``er_gym.TABLE`` is the group of their entry points."""
NOT_FROM_HERE = "import sys; sys.path[:] = [place for place in sys.path if place]\n"
"""The beginning of a program that ``python -c`` runs to ask another interpreter something: else it
would import a ``json.py`` or ``ai2thor.py`` that lies in the working directory."""
_IMPORTS: ContextVar[bool] = ContextVar("_IMPORTS", default=True)


@contextmanager
def without_imports() -> Iterator[None]:
    """For commands that promise to run nothing: within this, dotted names raise
    :class:`NotImported` instead of being imported. Any file could have named them, and any module
    of that name in the working directory would be run."""
    token = _IMPORTS.set(False)
    try:
        yield
    finally:
        _IMPORTS.reset(token)


@dataclass(frozen=True)
class Registry(Generic[T]):
    """Objects of one kind that a user chooses by name.

    Attributes:
        kind: the kind of the objects, for messages: ``"agent"``.
        group: the group of entry points in which other packages declare such objects.
        own: the objects that come with er-gym, by name.
        expected: what an object has to be, for messages: ``"a class with reset and act"``.
        fits: returns whether an object is of this kind, as far as this shows without calling it.
        others: further ways to name an object, for messages.
    """

    kind: str
    group: str
    own: Mapping[str, T]
    expected: str
    fits: Callable[[object], bool]
    others: str = ""

    def names(self) -> tuple[str, ...]:
        """The names of er-gym's own objects, then those of installed packages, each once."""
        return tuple(dict.fromkeys((*self.own, *sorted(entry_points(self.group)))))

    def get(self, name: str) -> T:
        """The object of a name; er-gym's own objects come before those of other packages.

        Raises:
            PluginError: the name is unknown, or its object cannot be imported or used.
        """
        if name in self.own:
            return self.own[name]
        entry = entry_points(self.group).get(name)
        if entry is not None:
            return self._checked(load_entry_point(entry, self.kind), f"entry point {name!r}")
        if not is_dotted(name):
            raise PluginError(self.unknown(name))
        try:
            found = load_dotted(name, self.kind, self.expected)
        except PluginError as error:
            cause, package = error.__cause__, name.partition(":")[0].partition(".")[0]
            if isinstance(cause, ModuleNotFoundError) and cause.name == package:
                raise PluginError(f"{self.unknown(name)}. {error}") from cause
            raise
        return self._checked(found, repr(name))

    def unknown(self, name: str) -> str:
        """The message for an unknown name: the known names, and the similar ones."""
        near = get_close_matches(name, self.names(), n=3)
        hint = f" (did you mean {' or '.join(near)}?)" if near else ""
        ways = [", ".join(self.names()), "package.module:Name", self.others]
        there = "; ".join(filter(None, ways))
        return f"unknown {self.kind} {name!r:.80}{hint}; choose one of: {there}"

    def _checked(self, found: object, name: str) -> T:
        if not self.fits(found):
            raise PluginError(f"{self.kind} {name} is {found!r}; give {self.expected}")
        return cast(T, found)


@lru_cache(maxsize=32)
def entry_points(group: str) -> Mapping[str, metadata.EntryPoint]:
    """The entry points of a group by name, of all installed packages.

    Raises:
        PluginError: two packages declare different things under one name.
    """
    found: dict[str, metadata.EntryPoint] = {}
    for entry in metadata.entry_points(group=group):
        other = found.setdefault(entry.name, entry)
        if other.value != entry.value:
            raise PluginError(
                f"two packages declare {entry.name!r} in the entry points {group!r}: "
                f"{_package(other)} ({other.value}) and {_package(entry)} ({entry.value}); "
                "uninstall one of them"
            )
    return MappingProxyType(found)


def load_entry_point(entry: metadata.EntryPoint, kind: str) -> Any:
    """Load the object of an entry point.

    Raises:
        PluginError: it cannot be loaded.
    """
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # a module can raise anything
        raise PluginError(
            f"{kind} {entry.name!r} of the package {_package(entry)} cannot be loaded from "
            f"{entry.value} ({error_line(error)}); mend or uninstall that package"
        ) from error


def added_objects(
    kind: str, table: str, expected: str, *, registers: bool = False
) -> Iterator[tuple[Any, str]]:
    """The rows of a table that :data:`VARIABLE` names and installed packages declare.

    Args:
        kind: the kind of the rows, for messages: ``"verb"``.
        table: one of :data:`TABLES`.
        expected: what an object has to be, for messages.
        registers: whether a module registers its objects itself when it is imported. Then a module
            that is being imported now is left out: its import made er-gym call this function, and
            goes on afterwards.

    Raises:
        PluginError: something cannot be loaded, or the variable is not spelled so.
    """
    for name in _named_for(table):
        if not (registers and _being_imported(name.partition(":")[0])):
            yield _loaded(name, kind, expected), f"{name} in ${VARIABLE}"  # the user named it
    group = f"er_gym.{table}"
    for name, entry in sorted(entry_points(group).items()):
        if not (registers and _being_imported(entry.module)):
            yield load_entry_point(entry, kind), f"entry point {name!r} of {group}"


def _named_for(table: str) -> list[str]:
    """The dotted names that :data:`VARIABLE` gives for a table.

    Raises:
        PluginError: it gives one for something that is no table.
    """
    named = []
    for item in filter(None, map(str.strip, os.environ.get(VARIABLE, "").split(","))):
        of, equals, name = map(str.strip, item.partition("="))
        if of not in TABLES or not equals:
            raise PluginError(
                f"${VARIABLE} holds {item!r:.80}; give TABLE=package.module:Name with commas "
                f"between them, where TABLE is one of: {', '.join(TABLES)}"
            )
        if of == table:
            named.append(name)
    return named


def _being_imported(module: str) -> bool:
    spec = getattr(sys.modules.get(module), "__spec__", None)
    return bool(getattr(spec, "_initializing", False))


def is_dotted(name: str) -> bool:
    """Whether a name is spelled as ``package.module:Name``, or ``package.module:Class.method``."""
    module, colon, attributes = name.partition(":")
    parts = (*module.split("."), *attributes.split("."))
    return bool(colon) and all(part.isidentifier() for part in parts)


def load_dotted(name: str, kind: str, expected: str) -> Any:
    """Load the object that ``package.module:Name`` names.

    The module is searched as by ``import``, then in the working directory.

    Raises:
        PluginError: the name has another form, or the module cannot be imported or lacks ``Name``.
        NotImported: within :func:`without_imports`.
    """
    if is_dotted(name) and not _IMPORTS.get():
        raise NotImported(f"{kind} {name!r} was not imported")
    return _loaded(name, kind, expected)


def _loaded(name: str, kind: str, expected: str) -> Any:
    if not is_dotted(name):
        raise PluginError(f"{kind} {name!r} is not a package.module:Name; give {expected}")
    module_name, _, attributes = name.partition(":")
    try:
        found: Any = _imported(module_name)
    except (Exception, SystemExit) as error:  # a module can raise anything
        raise PluginError(
            f"Cannot import {module_name!r} of {kind} {name!r} ({error_line(error)}); give "
            f"{expected}, in an installed package, the working directory or a folder on PYTHONPATH"
        ) from error
    for attribute in attributes.split("."):
        if not hasattr(found, attribute):
            near = get_close_matches(attribute, dir(found), n=3)
            hint = f" (did you mean {' or '.join(near)}?)" if near else ""
            raise PluginError(
                f"{kind} {name!r}: {module_name!r} has no {attribute!r}{hint}; give {expected}"
            )
        found = getattr(found, attribute)
    return found


def _imported(name: str) -> ModuleType:
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        here = os.getcwd()
        # A console script, unlike "python -m", does not look in the working directory.
        if error.name != name.split(".")[0] or here in sys.path or "" in sys.path:
            raise
        sys.path.append(here)
        try:
            return import_module(name)
        except ModuleNotFoundError:
            sys.path.remove(here)
            raise


def _package(entry: metadata.EntryPoint) -> str:
    return entry.dist.name if entry.dist else "unknown"


def error_line(error: BaseException) -> str:
    """The type and the first line of an exception."""
    first_line = (str(error).strip().splitlines() or [""])[0]
    return f"{type(error).__name__}: {first_line}"
