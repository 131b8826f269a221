"""The tables of a page as CSV and as JSON: whatever a page can show as a table can be saved.

They are read from the page itself, so that no table is described twice. A table has a name
(``data-table``); a cell says its value where its words do not (``data-value``, ``data-low`` and
``data-high`` of an interval, and so on: each is a column); a row says its id (``data-row``).
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from html.parser import HTMLParser

from er_gym.tables import Table

KINDS = {"csv": "text/csv; charset=utf-8", "json": "application/json; charset=utf-8"}
"""The kinds of files, by the parameter of an address that asks for one."""
_PARTS = ("data-value", "data-low", "data-high", "data-why", "data-flag", "data-note", "data-tags")
_NUMBER = re.compile(r"[-+−]?[0-9][0-9,]*(\.[0-9]+)?(e[-+]?[0-9]+)?")
_RISKY = ("=", "+", "-", "@", "\t", "\r")
"""A spreadsheet takes a text that begins so for a formula."""


def saved_table(page: str, name: str, kind: str) -> str | None:
    """A table of a page as the text of a file; None if the page has none of this name.

    Args:
        page: HTML.
        name: the table's.
        kind: one of :data:`KINDS`.
    """
    reader = _Reader(name)
    reader.feed(page)
    reader.close()
    if reader.rows is None:
        return None
    head, rows = _columns(reader.head, reader.rows)
    if kind == "csv":
        safe = tuple(tuple(map(_harmless, row)) for row in rows)
        return Table("", tuple(map(_harmless, head)), safe, len(head)).csv()
    told = [dict(zip(head, map(_value, row), strict=True)) for row in rows]
    return json.dumps(told, ensure_ascii=False, indent=1) + "\n"


@dataclass
class _Cell:
    """A cell: its words, and the values that it states."""

    words: list[str] = field(default_factory=list)
    values: dict[str, str] = field(default_factory=dict)

    @property
    def text(self) -> str:
        return " ".join("".join(self.words).split())


class _Reader(HTMLParser):
    """Reads the cells of one table."""

    def __init__(self, name: str) -> None:
        super().__init__(convert_charrefs=True)
        self.head: list[str] = []
        self.rows: list[tuple[str, list[_Cell]]] | None = None
        self._name, self._inside, self._cell = name, False, _Cell()
        self._in_cell = False
        self._ids: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = {name: value or "" for name, value in attrs}
        if tag == "table" and self.rows is None and told.get("data-table") == self._name:
            self._inside, self.rows = True, []
        if not self._inside or self.rows is None:
            return
        if tag == "tr":
            self.rows.append((told.get("data-row", ""), []))
        elif tag in ("td", "th"):
            self._cell, self._in_cell = _Cell(), True
        if self._in_cell:
            self._cell.words += " " * (tag in ("br", "div", "p", "td", "th"))
            self._cell.values |= {name: told[name] for name in _PARTS if name in told}

    def handle_endtag(self, tag: str) -> None:
        if not self._inside or self.rows is None:
            return
        if tag in ("td", "th") and self._in_cell:
            self.rows[-1][1].append(self._cell)
            self._in_cell = False
        elif tag == "thead":
            self.head = [each.text for _, cells in self.rows for each in cells]
            self.rows.clear()
        elif tag == "table":
            self._inside = False

    def handle_data(self, data: str) -> None:
        if self._inside and self._in_cell:
            self._cell.words.append(data)


def _columns(
    heads: Sequence[str], rows: Sequence[tuple[str, list[_Cell]]]
) -> tuple[list[str], list[list[str]]]:
    """The names of the columns and the cells; an interval has columns of its own."""
    full = [(id, cells) for id, cells in rows if len(cells) == len(heads)]
    head: list[str] = []
    columns: list[list[str]] = []
    if any(id for id, _ in full):
        head.append("id")
        columns.append([id for id, _ in full])
    for number, name in enumerate(heads):
        cells = [cells[number] for _, cells in full]
        if not name and not any(each.text or each.values for each in cells):
            continue  # boxes to tick
        for part in _PARTS:
            if part != _PARTS[0] and not any(part in each.values for each in cells):
                continue
            plain = re.sub(r" [▾▴]$", "", name) or "name"
            head.append(plain if part == _PARTS[0] else f"{plain} {part.removeprefix('data-')}")
            columns.append(
                [each.values.get(part, each.text if part == _PARTS[0] else "") for each in cells]
            )
    seen: dict[str, int] = {}
    for place, name in enumerate(head):
        seen[name] = seen.get(name, 0) + 1
        head[place] = f"{name} {seen[name]}" if seen[name] > 1 else name
    return head, [list(row) for row in zip(*columns, strict=True)]


def _value(text: str) -> str | int | float | None:
    """A cell for JSON."""
    if text in ("", "–"):
        return None
    if not _NUMBER.fullmatch(text):
        return text
    plain = text.replace(",", "").replace("−", "-")
    return float(plain) if re.search(r"[.e]", plain) else int(plain)


def _harmless(text: str) -> str:
    """A cell for CSV: a number as programs read it, and no formula."""
    if text == "–":
        return ""
    if _NUMBER.fullmatch(text):
        return text.replace(",", "").replace("−", "-")
    return f"'{text}" if text.startswith(_RISKY) else text
