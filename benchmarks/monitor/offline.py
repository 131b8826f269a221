"""Turns a page of the server into one that opens from a disk.

The pages are the server's own, so an export shows what the server shows. Addresses of the server
become others, or go; what needs the server, which is marked with ``data-online``, goes as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from html import escape
from html.parser import HTMLParser
from typing import TypeAlias
from urllib.parse import parse_qsl, urlsplit

Link: TypeAlias = Callable[[str, Mapping[str, str]], "str | None"]
"""From an address of the server, as path and parameters, to another; None if there is none."""
_ADDRESSES = frozenset({"href", "src", "action", "data-src", "data-frame", "data-map"})
_VOID = frozenset({"area", "br", "col", "hr", "img", "input", "link", "meta", "wbr"})


@dataclass(frozen=True)
class OfflinePage:
    """A page without its shell.

    Attributes:
        title: plain text.
        body: what is in the ``body``, as HTML.
    """

    title: str
    body: str


def offline(page: str, link: Link, drawing: Callable[[Mapping[str, str]], str]) -> OfflinePage:
    """A page of the server for a disk.

    Args:
        page: as the server sends it.
        link: the new address for an old one.
        drawing: the map for an address's parameters, as HTML, which is put where the page would
            fetch it.
    """
    reader = _Reader(link, drawing)
    reader.feed(page)
    reader.close()
    return OfflinePage("".join(reader.title), "".join(reader.body))


class _Reader(HTMLParser):
    """Writes the body of a page anew while it reads it."""

    def __init__(self, link: Link, drawing: Callable[[Mapping[str, str]], str]) -> None:
        super().__init__(convert_charrefs=False)
        self.title: list[str] = []
        self.body: list[str] = []
        self._link, self._drawing = link, drawing
        self._in_title = self._in_body = False
        self._dropped: list[str] = []
        """The tags that are open in an element that is left out."""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        if self._dropped or "data-online" in told:
            if tag not in _VOID:
                self._dropped.append(tag)
        elif tag == "title" and not self._in_body:
            self._in_title = True
        elif tag == "body":
            self._in_body = True
        elif self._in_body:
            self._write(tag, attrs, told)

    def _write(
        self, tag: str, attrs: list[tuple[str, str | None]], told: dict[str, str | None]
    ) -> None:
        online = [name for name in _ADDRESSES & told.keys() if _is_online(told[name])]
        if not online:  # as it was: SVG has names with capital letters
            self.body.append(self.get_starttag_text() or "")
            return
        written = []
        for name, value in attrs:
            if name in online:
                value = "" if name == "data-map" else self._moved(value or "")
                if value is None:
                    continue
            written.append(name if value is None else f'{name}="{escape(value)}"')
        self.body.append(f"<{' '.join((tag, *written))}>")
        if "data-map" in online:
            self.body.append(self._drawing(_parsed(told["data-map"] or "")[1]))

    def _moved(self, address: str) -> str | None:
        path, parameters = _parsed(address)
        return self._link(path, parameters)

    def handle_endtag(self, tag: str) -> None:
        if self._dropped:
            if tag in self._dropped:
                while self._dropped.pop() != tag:
                    pass
        elif tag == "title":
            self._in_title = False
        elif tag == "body":
            self._in_body = False
        elif self._in_body:
            self.body.append(f"</{tag}>")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if self._in_body and not self._dropped:
            self.body.append(self.get_starttag_text() or "")

    def handle_data(self, data: str) -> None:
        self._text(data)

    def handle_entityref(self, name: str) -> None:
        self._text(f"&{name};")

    def handle_charref(self, name: str) -> None:
        self._text(f"&#{name};")

    def _text(self, text: str) -> None:
        if self._dropped:
            return
        if self._in_title:
            self.title.append(text)
        elif self._in_body:
            self.body.append(text)


def _is_online(address: str | None) -> bool:
    return (address or "").startswith("/")


def _parsed(address: str) -> tuple[str, dict[str, str]]:
    parts = urlsplit(address)
    return parts.path, dict(parse_qsl(parts.query))
