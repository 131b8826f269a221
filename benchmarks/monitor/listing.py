"""Lists that an address filters, sorts and turns the pages of."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, ClassVar, Generic, TypeAlias, TypeVar
from urllib.parse import urlencode

from er_gym.tasks.types import canonical_names

PAGE_ROWS = 100
_MOST_TEXT = 300
_MOST_PAGES = 10**6

Row = TypeVar("Row")
_Filter = TypeVar("_Filter", bound="AddressFilter[Any]")
_Class: TypeAlias = type[_Filter]
"""Under another name, since a filter has a field ``type``."""


@dataclass(frozen=True)
class AddressFilter(Generic[Row]):
    """Which rows of a list are shown, and in which order; each field is a parameter of the address.

    Attributes:
        sorts: what rows are sorted by, for each name of an order.
        text: part of what a row says, whatever the case.
        sort: one of ``sorts``; with ``-`` before it, descending.
        page: from 1; 0 for the whole list.
    """

    sorts: ClassVar[Mapping[str, Callable[[Any], Any]]] = {}

    text: str = ""
    sort: str = ""
    page: int = 1

    @classmethod
    def names(cls) -> list[str]:
        """The parameters in the order of an address: those of all lists at its end."""
        return sorted((each.name for each in fields(cls)), key=("text", "sort", "page").count)

    @classmethod
    def of(cls: _Class[_Filter], parameters: Mapping[str, str]) -> _Filter:
        """From an address; what makes no sense there is passed over."""
        texts = {each.name: parameters.get(each.name, "") for each in fields(cls)}
        if texts["sort"].removeprefix("-") not in cls.sorts:
            del texts["sort"]
        given: dict[str, Any] = {name: text[:_MOST_TEXT] for name, text in texts.items() if text}
        return cls(**given | {"page": page_number(parameters)})

    def query(self, **changes: Any) -> str:
        """The parameters of an address, with some changed or added; the page begins again."""
        told = {name: getattr(self, name) for name in self.names()}
        told |= {"page": 1, **changes}
        defaults = {each.name: each.default for each in fields(self)}
        return urlencode({k: str(value) for k, value in told.items() if value != defaults.get(k)})

    def takes(self, row: Row) -> bool:
        """Whether a row is shown."""
        raise NotImplementedError

    def chosen(self, rows: Iterable[Row]) -> list[Row]:
        """The rows that are shown, sorted."""
        taken = [row for row in rows if self.takes(row)]
        key = self.sorts[self.sort.removeprefix("-")]
        taken.sort(key=key, reverse=self.sort.startswith("-"))
        return taken

    def says(self, said: str) -> bool:
        """Whether a row is shown as far as its words tell."""
        return not self.text or self.text.casefold() in said.casefold()


@dataclass(frozen=True)
class TaskFilter(AddressFilter[Row]):
    """Which rows of a list of tasks are shown.

    Attributes:
        type: any name of a type of task or of a group, which stands for its types
            (:func:`er_gym.tasks.types.types_named`); "" for any.
    """

    type: str = ""

    def matches(self, type: str, exact: Mapping[str, str], said: str) -> bool:
        """Whether a row is shown as far as these tell.

        Args:
            type: the row's type of task, by its name in task files.
            exact: by the name of a field, what the row must have unless that is "".
            said: what the row says.
        """
        return (
            self.takes_type(type)
            and all(getattr(self, name) in ("", value) for name, value in exact.items())
            and self.says(said)
        )

    def takes_type(self, name: str) -> bool:
        """Whether a type of task is shown, by its name in task files."""
        return not self.type or name in self._types

    @cached_property
    def _types(self) -> frozenset[str]:
        try:
            return frozenset((self.type, *canonical_names([self.type])))
        except ValueError:  # of a package that is not installed here, or unknown
            return frozenset([self.type])

    def unknown_type(self, present: Collection[str]) -> str:
        """Why the name of the type means nothing, in a line; "" if it means something.

        Args:
            present: the types in the list; one that another package adds may be unknown here.
        """
        if self.type in ("", *present):
            return ""
        try:
            canonical_names([self.type])
        except ValueError as error:
            return str(error)
        return ""


@dataclass(frozen=True)
class Page(Generic[Row]):
    """Some rows of a list.

    Attributes:
        rows: of this page.
        total: how many rows the list has.
        number, last: of this page and of the last one, from 1.
    """

    rows: Sequence[Row]
    total: int
    number: int
    last: int


def page_number(parameters: Mapping[str, str]) -> int:
    """The page that an address asks for, from 1; 1 if it makes no sense. 0, the whole list, if it
    asks for a file."""
    if parameters.get("as"):
        return 0
    text = parameters.get("page", "")
    return max(1, min(int(text[:7]), _MOST_PAGES)) if text.isascii() and text.isdigit() else 1


def page_of(rows: Sequence[Row], number: int) -> Page[Row]:
    """A page of a list; the last one if it has fewer, and the whole list for 0."""
    if not number:
        return Page(rows, len(rows), 1, 1)
    last = max(1, -(-len(rows) // PAGE_ROWS))
    number = min(number, last)
    return Page(rows[(number - 1) * PAGE_ROWS : number * PAGE_ROWS], len(rows), number, last)


def neighbours(keys: Sequence[str], key: str) -> tuple[str, str]:
    """The keys before and after one; "" for none."""
    if key not in keys:
        return "", ""
    at = keys.index(key)
    return keys[at - 1] if at else "", keys[at + 1] if at + 1 < len(keys) else ""
