"""Paraphrases of instructions by a language model.

The user supplies the model: any function from a prompt to a reply. Replies are stored in a file, so
that the model is asked only once. Stored replies are checked each time they are used.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import zlib
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TypeAlias

from pydantic import BaseModel, ConfigDict

from er_gym.plugins import Registry
from er_gym.tasks.files import validated
from er_gym.tasks.reading import parse_json, read_bytes
from er_gym.thor import OBJECT_TYPES
from er_gym.writing import CannotWrite, make_folder, write_atomic

Ask: TypeAlias = Callable[[str], str]
"""A language model: a function from a prompt to a reply."""

LONGEST = 400
"""The most characters of a paraphrase."""

PROMPT_VERSION = 1
"""Part of the key of stored replies; after a change, the model is asked again."""

_PROMPT = """\
Here is an instruction for a robot in a home:

{instruction}

Write {count} other ways to say it. Each must mean exactly the same: the same things, the same
places, the same order, nothing left out and nothing added. Vary the wording: a command, a polite
request, a question, a statement of what is needed.
{names}
Write one instruction on each line, each at most {longest} characters long, beginning with a capital
letter and ending with a full stop or a question mark. No numbering, no quotation marks, no other
text.
"""
_NAMES = "\nKeep these words spelled exactly as they are, capital letters included: {names}.\n"

_BULLET = re.compile(r"(?:[-*•–—]\s+|\(?\d{1,2}[.):]+\s*)")
_QUOTES = tuple(zip("\"'“‘«`*", "\"'”’»`*", strict=True))
_SENTENCES = re.compile(r"[A-Z][^\x00-\x1f\x7f{}]*[a-z][^\x00-\x1f\x7f{}]*[.?!]")
_WORD = re.compile(r"\w+")


_BEGINS = b'{"key": "'
"""The beginning of every line of the file of replies."""


class _Entry(BaseModel):
    """A line of the file of replies."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    key: str
    instruction: str
    reply: str


class Paraphraser:
    """Asks a model for paraphrases and stores its replies.

    Processes may share a file. If two processes ask about the same instruction at the same time,
    the first stored reply is used later. Models should not share a file, because it does not store
    which model replied.
    """

    def __init__(self, ask: Ask, cache: Path | None, count: int = 3) -> None:
        """Read the stored replies.

        Args:
            ask: the model; its exceptions are not caught.
            cache: a file of JSON lines, created with the first reply; None to store nothing.
            count: how many paraphrases to ask for and, at most, to return.

        Raises:
            ValueError: ``count`` is below 1, or er-gym did not write ``cache``.
        """
        if count < 1:
            raise ValueError(f"count is {count}; ask for at least 1 paraphrase")
        self._ask = ask
        self._cache = cache
        self._count = count
        self._replies = {} if cache is None else _read(cache)

    def __call__(self, instruction: str, names: Collection[str]) -> tuple[str, ...]:
        """Up to ``count`` paraphrases of an instruction; none if the model gave no usable one.

        Args:
            instruction: one line of English.
            names: words that each paraphrase must hold in this spelling: object types, perhaps
                "off".

        Raises:
            ValueError: the instruction lacks one of the names, or the model's reply is not a str.
        """
        if lacking := sorted(name for name in set(names) if not _has(instruction, name)):
            raise ValueError(
                f"the instruction {instruction!r} lacks {', '.join(map(repr, lacking))}; "
                "give names as they stand in it"
            )
        prompt = make_prompt(instruction, names, self._count)
        key = hashlib.sha256(f"{PROMPT_VERSION}\n{prompt}".encode()).hexdigest()
        if key not in self._replies:
            reply = self._ask(prompt)
            if not isinstance(reply, str):
                raise ValueError(
                    f"the language model returned {type(reply).__name__}, not a text; let it "
                    "return its reply, as str"
                )
            entry = _Entry(key=key, instruction=instruction, reply=reply)
            if self._cache is not None:
                _append(self._cache, entry)
            self._replies[key] = entry.reply
        return usable(self._replies[key], instruction, names)[: self._count]


def make_prompt(instruction: str, names: Collection[str], count: int) -> str:
    """The prompt for a model; it does not depend on the order of ``names``."""
    kept = _NAMES.format(names=", ".join(sorted(set(names)))) if names else ""
    return _PROMPT.format(instruction=instruction, count=count, names=kept, longest=LONGEST)


def usable(reply: str, instruction: str, names: Collection[str]) -> tuple[str, ...]:
    """The lines of a reply that can replace the instruction, in order, without duplicates.

    Such a line consists of whole sentences with at most :data:`LONGEST` characters. It has all of
    ``names`` and no object type that the instruction lacks. Its meaning is not checked.
    """
    own_types = _types(instruction)
    seen = {_plain(instruction)}
    found = []
    for line in map(_bare, reply.splitlines()):
        if (
            len(line) <= LONGEST
            and line.isprintable()
            and _SENTENCES.fullmatch(line)
            and all(_has(line, name) for name in names)
            and _types(line) <= own_types
            and _plain(line) not in seen
        ):
            seen.add(_plain(line))
            found.append(line)
    return tuple(found)


def names_in(instruction: str) -> frozenset[str]:
    """The object types that an instruction names."""
    return frozenset(_types(instruction))


def choose(variants: Sequence[str], task_id: str) -> str:
    """One of several wordings of a task; the same for the same id in every process.

    Raises:
        ValueError: there are no wordings.
    """
    if not variants:
        raise ValueError(f"task {task_id}: no wordings to choose from; give at least one")
    return variants[zlib.crc32(task_id.encode()) % len(variants)]


PARAPHRASERS: Registry[Ask] = Registry(
    kind="paraphraser",
    group="er_gym.paraphrasers",
    own={},
    expected="a function from a prompt to a reply",
    fits=callable,
)
"""The language models of other packages, by name; er-gym has none."""


def load_ask(spec: str) -> Ask:
    """Load a language model by its name, such as ``my_package.models:ask``.

    Raises:
        ValueError: there is no function of that name.
    """
    return PARAPHRASERS.get(spec)


def _read(cache: Path) -> dict[str, str]:
    """Key to reply; incomplete lines, whose writer was killed, are skipped."""
    replies: dict[str, str] = {}
    if not cache.exists():
        return replies
    for number, line in enumerate(read_bytes(cache).split(b"\n"), 1):
        where = f"{cache}: the reply in line {number}"
        try:
            data = parse_json(line.decode(), cache, number)
        except ValueError:  # not JSON, or not even text
            if line[: len(_BEGINS)] != _BEGINS[: len(line)]:
                raise ValueError(
                    f"{where} is not a reply, nor a part of one: er-gym did not write this file; "
                    "move it, or choose another --out"
                ) from None
            continue
        entry = validated(_Entry, data, where)
        replies.setdefault(entry.key, entry.reply)
    return replies


def _append(cache: Path, entry: _Entry) -> None:
    """Append a line in one write, so that at most this line is incomplete if er-gym is killed."""
    make_folder(cache.parent)
    line = json.dumps(entry.model_dump()).encode() + b"\n"
    if cache.exists() and (cache.is_symlink() or cache.stat().st_nlink > 1):
        write_atomic(cache, cache.read_bytes())  # a file of its own: no other one grows with it
    with open(cache, "ab+", buffering=0) as file:  # O_APPEND keeps other writers' lines intact
        end = file.seek(0, os.SEEK_END)
        if end:
            file.seek(end - 1)
            if file.read(1) != b"\n":  # an incomplete line must not spoil this one
                line = b"\n" + line
        if file.write(line) != len(line):
            raise CannotWrite(f"{cache}: cannot be written: the disk is full")


def _bare(line: str) -> str:
    """A line without numbering, bullet and quotation marks, with single spaces."""
    line = " ".join(line.split())
    if bullet := _BULLET.match(line):
        line = line[bullet.end() :]
    for opening, closing in _QUOTES:
        if len(line) > 1 and line.startswith(opening) and line.endswith(closing):
            line = line[1:-1].strip(opening + closing)
    return line


def _has(text: str, name: str) -> bool:
    """Whether a text has a name, in this spelling, as separate words."""
    return re.search(rf"(?<!\w){re.escape(name)}(?!\w)", text) is not None


def _types(text: str) -> set[str]:
    return {word for word in _WORD.findall(text) if word in OBJECT_TYPES}


def _plain(text: str) -> str:
    """A text reduced to its words in lower case, for comparison."""
    return " ".join(_WORD.findall(text)).casefold()
