"""Caches replies on disk, so that no request is sent and paid for twice."""

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
    """A client that states what its replies depend on besides the conversation."""

    @property
    def identity(self) -> str:
        """Model, server and parameters as text; clients with equal texts reply alike."""


class ReplyCache:
    """Wraps a client and answers repeated requests from disk.

    The directory is created if it does not exist. Several threads and processes may share it. If a
    process is killed, the replies stored before remain readable. A damaged cache is moved aside
    with a warning, and a new one is begun.

    Args:
        client: answers the requests that are not in the cache.
        directory: holds the cache.

    Raises:
        ValueError: the directory cannot be used.
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
                f"replies cannot be cached in {directory} ({error}); choose another --out"
            ) from error

    @property
    def identity(self) -> str:
        """The wrapped client's identity."""
        return self._client.identity

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn; a cached reply has its original usage and cost."""
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
        """Close the cache and the wrapped client."""
        self._cache.close()
        self._client.close()

    def _guarded(self, do: Callable[[Any], T]) -> T | None:
        """Use the cache; None if it fails, since a failing cache must not lose a reply."""
        cache = self._cache
        try:
            return do(cache)
        except (sqlite3.OperationalError, diskcache.Timeout, OSError) as error:
            warnings.warn(f"{self._directory}: replies are not cached: {error}", stacklevel=3)
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
                warnings.warn(f"{self._directory}: replies are not cached: {error}", stacklevel=4)


def key_of(identity: str, messages: Sequence[Message], seed: int) -> str:
    """sha256, in hex, of everything that a reply depends on."""
    said = [
        [message.role, [_essence(part) for part in message.parts], message.reasoning]
        for message in messages
    ]
    return hashlib.sha256(json.dumps([_FORMAT, identity, seed, said]).encode()).hexdigest()


def _essence(part: str | Picture) -> str | list[str]:
    return part if isinstance(part, str) else [part.media_type, part.digest]


class _Texts(diskcache.Disk):
    """Reads texts only. The default would unpickle values, which runs code from the file."""

    def fetch(self, mode: int, filename: str | None, value: Any, read: bool) -> Any:
        """A value; a pickled one raises FileNotFoundError, which counts as not cached."""
        if mode == diskcache.core.MODE_PICKLE:
            raise FileNotFoundError("no text")
        return super().fetch(mode, filename, value, read)


def _open(directory: Path) -> Any:
    # No eviction. Memory mapping is fast, but a truncated file would kill the process.
    return diskcache.Cache(
        str(directory), disk=_Texts, eviction_policy="none", cull_limit=0, sqlite_mmap_size=0
    )


def _anew(directory: Path, error: Exception) -> Any:
    """Move a damaged cache aside and open an empty one in its place."""
    number = 1
    while (aside := directory.with_name(f"{directory.name}.damaged-{number}")).exists():
        number += 1
    os.rename(directory, aside)
    warnings.warn(f"{directory} is damaged ({error}); it was moved to {aside}", stacklevel=2)
    return _open(directory)


def _read(cache: Any, key: str) -> Reply | None:
    try:
        text = cache.get(key)
        return None if text is None else _REPLY.validate_json(text)
    except ValueError:  # a truncated value
        return None
