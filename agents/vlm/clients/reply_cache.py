"""Replies kept on disk: what has been asked once is not asked, nor paid for, again."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
import threading
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Protocol, TypeVar

import diskcache
from pydantic import TypeAdapter

from agents.vlm.chat import Client, Message, Picture, Reply

_FORMAT = "er-gym/reply/1"
_REPLY = TypeAdapter(Reply)

T = TypeVar("T")


class CacheableClient(Client, Protocol):
    """A client that says what its replies depend on, beside the conversation."""

    @property
    def identity(self) -> str:
        """Model, server, parameters: the same text for what replies alike."""


class ReplyCache:
    """Asks another client only what has not been asked before.

    Where nothing is kept in the directory yet it is made. Several threads and processes may share
    it. If one is killed, the others and those that come after find all that was kept before. A
    damaged file is set aside with a warning, and replies are kept anew.

    Args:
        client: is asked the rest.
        directory: where replies are kept.

    Raises:
        ValueError: nothing can be kept in the directory.
    """

    def __init__(self, client: CacheableClient, directory: Path) -> None:
        self._client, self._directory = client, directory
        self._lock = threading.Lock()
        try:
            try:
                self._cache = _open(directory)
            except sqlite3.DatabaseError as error:
                if isinstance(error, sqlite3.OperationalError):
                    raise
                self._cache = _anew(directory, error)
        except (OSError, sqlite3.Error, diskcache.Timeout) as error:
            raise ValueError(
                f"replies cannot be kept in {directory} ({error}); choose another --out"
            ) from error

    @property
    def identity(self) -> str:
        """The other client's."""
        return self._client.identity

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn; usage and cost of a kept one are what they once were."""
        began = time.monotonic()
        key = key_of(self.identity, messages, seed)
        found = self._guarded(lambda cache: _read(cache, key))
        if found is not None:
            return replace(found, from_cache=True, seconds=time.monotonic() - began)
        reply = self._client.reply(messages, seed)
        fields = asdict(reply)
        del fields["from_cache"]  # says how a reply was had, not what it is
        text = json.dumps(fields)
        self._guarded(lambda cache: cache.set(key, text))
        return reply

    def close(self) -> None:
        """Close the files and the other client."""
        self._cache.close()
        self._client.close()

    def _guarded(self, do: Callable[[Any], T]) -> T | None:
        """Use the cache; None where it does not work, which is no reason to lose a reply."""
        cache = self._cache
        try:
            return do(cache)
        except (sqlite3.OperationalError, diskcache.Timeout, OSError) as error:
            warnings.warn(f"{self._directory}: replies are not kept: {error}", stacklevel=3)
        except sqlite3.DatabaseError as error:
            self._begin_anew(cache, error)
        return None

    def _begin_anew(self, damaged: Any, damage: Exception) -> None:
        with self._lock:
            if self._cache is not damaged:  # another thread has done so
                return
            try:
                self._cache = _anew(self._directory, damage)
            except (OSError, sqlite3.Error) as error:
                warnings.warn(f"{self._directory}: replies are not kept: {error}", stacklevel=4)


def key_of(identity: str, messages: Sequence[Message], seed: int) -> str:
    """sha256, in hex, of all that a reply depends on."""
    said = [
        [message.role, [_essence(part) for part in message.parts], message.reasoning]
        for message in messages
    ]
    return hashlib.sha256(json.dumps([_FORMAT, identity, seed, said]).encode()).hexdigest()


def _essence(part: str | Picture) -> str | list[str]:
    return part if isinstance(part, str) else [part.media_type, part.digest]


class _Texts(diskcache.Disk):
    """Reads texts only. Otherwise it would unpickle, and so run, what others put into the file."""

    def fetch(self, mode: int, filename: str | None, value: Any, read: bool) -> Any:
        """A value; a missing file, which counts as none kept, in place of a pickled one."""
        if mode == diskcache.core.MODE_PICKLE:
            raise FileNotFoundError("no text")
        return super().fetch(mode, filename, value, read)


def _open(directory: Path) -> Any:
    # Nothing is ever dropped. Mapped memory is fast, but kills the process if the file is cut off.
    return diskcache.Cache(
        str(directory), disk=_Texts, eviction_policy="none", cull_limit=0, sqlite_mmap_size=0
    )


def _anew(directory: Path, error: Exception) -> Any:
    """Set a damaged cache aside, and open an empty one in its place."""
    number = 1
    while (aside := directory.with_name(f"{directory.name}.damaged-{number}")).exists():
        number += 1
    os.rename(directory, aside)
    warnings.warn(f"{directory} is damaged ({error}); it is now {aside}", stacklevel=2)
    return _open(directory)


def _read(cache: Any, key: str) -> Reply | None:
    try:
        text = cache.get(key)
        return None if text is None else _REPLY.validate_json(text)
    except ValueError:  # a file of a value that is cut off
        return None
