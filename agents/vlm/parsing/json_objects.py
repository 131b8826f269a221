"""JSON as models write it: with single quotes, commas too many, or no end."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass

from agents.vlm.parsing.vocabulary import normalized

_DOUBLE, _SINGLE = r'"([^"\\]*(?:\\.[^"\\]*)*)"?', r"'([^'\\]*(?:\\.[^'\\]*)*)'?"
_PAIR = re.compile(
    r"(?:[\"']([^\"'\n]{1,40})[\"']|(?<!\w)(\w{1,40}))\s{0,20}[:：]\s{0,20}\[?\s{0,20}"
    rf"(?:{_DOUBLE}|{_SINGLE}|([^\W\d_][\w |+.-]{{0,80}}))",
    re.DOTALL,
)
_OPENS = re.compile(r"\{|\[\s{0,20}\{")
_INSIDE = re.compile(r'[{}\[\]]|"[^"\\]*(?:\\.[^"\\]*)*"?', re.DOTALL)
"""Braces, and strings, in which braces are only letters."""
_DEEPER = {"{": 1, "[": 1, "}": -1, "]": -1}


@dataclass(frozen=True)
class JsonObject:
    """An object found in a text: where it begins, and its fields, by plain name."""

    start: int
    fields: Mapping[str, str]


def objects_in(text: str, most: int) -> list[JsonObject]:
    """The last objects of a text, and lists of objects, each list as one; in order."""
    return [JsonObject(start, fields_in(text[start:end])) for start, end in _spans(text)[-most:]]


def _spans(text: str) -> list[tuple[int, int]]:
    """Where they begin and end; the last may lack its end."""
    spans: list[tuple[int, int]] = []
    at = 0
    while opened := _OPENS.search(text, at):
        at, depth = len(text), 0
        for token in _INSIDE.finditer(text, opened.start()):
            depth += _DEEPER.get(token[0], 0)
            if depth == 0:
                at = token.end()
                break
        spans.append((opened.start(), at))
    return spans


def fields_in(text: str) -> dict[str, str]:
    """The fields of an object that are words, at whatever depth; of one name, the first.

    They are read pair by pair, so that it does not matter whether the whole is well formed.
    """
    fields: dict[str, str] = {}
    for pair in _PAIR.finditer(text):
        double, single, bare = pair[3], pair[4], pair[5]
        value = _unescaped(double) if double is not None else single if single is not None else bare
        if double is not None and value.lstrip().startswith("{"):
            fields = {**fields_in(value), **fields}  # arguments as JSON inside of JSON
        fields.setdefault(normalized(pair[1] or pair[2]), value.strip())
    return fields


def _unescaped(inside: str) -> str:
    try:
        return str(json.loads(f'"{inside}"', strict=False))
    except ValueError:
        return inside
