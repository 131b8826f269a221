"""Reads JSON as models write it: with single quotes, extra commas, or no end."""

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
_SECOND = re.compile(
    rf"\s{{0,20}},\s{{0,20}}(?:{_DOUBLE.rstrip('?')}|{_SINGLE.rstrip('?')})\s{{0,20}}\]", re.DOTALL
)
"""The second and last string of a list, behind the first."""
_WRAPPED = re.compile(
    r"[\"'](\w{1,40})[\"']\s{0,20}:\s{0,20}\{\s{0,20}"
    r"[\"'](?:name|type|id|object|object_?type|object_?id|object_?name)[\"']\s{0,20}:\s{0,20}"
    r"[\"']([^\"'\n]{1,80})[\"']",
    re.IGNORECASE,
)
"""``"receptacle": {"name": "Fridge"``"""
_OPENS = re.compile(r"\{|\[\s{0,20}\{")
_INSIDE = re.compile(r'[{}\[\]]|"[^"\\]*(?:\\.[^"\\]*)*"?', re.DOTALL)
"""Braces, and strings, whose braces do not count."""
_DEEPER = {"{": 1, "[": 1, "}": -1, "]": -1}


@dataclass(frozen=True)
class JsonObject:
    """An object found in a text: where it begins, and its fields, by plain name."""

    start: int
    fields: Mapping[str, str]


def objects_in(text: str, most: int) -> list[JsonObject]:
    """The last ``most`` objects of a text in order; a list of objects counts as one."""
    return [JsonObject(start, fields_in(text[start:end])) for start, end in _spans(text)[-most:]]


def _spans(text: str) -> list[tuple[int, int]]:
    """The start and end of each object; the last may lack its closing brace."""
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
    """The string fields of an object at any depth; for equal names, the outermost counts, and of
    these the first. The second of a list of two strings is had as ``args 2``.

    Fields are read pair by pair, so the object need not be valid JSON.
    """
    fields: dict[str, str] = {}
    for pair in _outermost_first(text):
        double, single, bare = pair[3], pair[4], pair[5]
        value = _unescaped(double) if double is not None else single if single is not None else bare
        if double is not None and value.lstrip().startswith("{"):
            fields = {**fields_in(value), **fields}  # arguments as JSON inside of JSON
        name = normalized(pair[1] or pair[2])
        fields.setdefault(name, value.strip())
        if bare is None and (second := _SECOND.match(text, pair.end())):
            fields.setdefault(f"{name} 2", (second[1] or second[2] or "").strip())
    for wrapped in _WRAPPED.finditer(text):
        fields.setdefault(normalized(wrapped[1]), wrapped[2].strip())
    return fields


def _outermost_first(text: str) -> list[re.Match[str]]:
    tokens = _INSIDE.finditer(text)
    token, depth = next(tokens, None), 0
    depths: list[tuple[int, re.Match[str]]] = []
    for pair in _PAIR.finditer(text):
        while token is not None and token.start() < pair.start():
            depth += _DEEPER.get(token[0], 0)
            token = next(tokens, None)
        depths.append((depth, pair))
    return [pair for _, pair in sorted(depths, key=lambda each: each[0])]


def _unescaped(inside: str) -> str:
    try:
        return str(json.loads(f'"{inside}"', strict=False))
    except ValueError:
        return inside
