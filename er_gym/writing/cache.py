"""Files in the user's cache that can be made again at any time."""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from collections.abc import Callable
from hashlib import blake2b
from pathlib import Path

from er_gym.writing.atomic import write_new

_DIGEST = 16
_OLD = 30 * 24 * 3600.0
"""Seconds after which a folder that another source has filled is taken away."""


def user_cache() -> Path:
    """er-gym's folder in ``$XDG_CACHE_HOME`` or ``~/.cache``; it may not exist."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "er-gym"


def kept(kind: str, key: str, name: str, make: Callable[[], bytes]) -> bytes:
    """What ``make`` returns, out of the user's cache if it is there, and put there if it is not.

    A cache that cannot be read or written is done without, and a file that is not as it was
    written is made again. Several processes may do this at once.

    Args:
        kind: what is kept, a word for a folder's name.
        key: of what the values depend on; another key is another folder.
        name: of the file, unique under its key.
    """
    path = _folder(kind, key) / name
    with contextlib.suppress(OSError, RuntimeError):  # RuntimeError: no home is known
        found = path.read_bytes()
        if found[:_DIGEST] == _digest(found[_DIGEST:]):
            return found[_DIGEST:]
    made = make()
    with contextlib.suppress(OSError, RuntimeError):
        if not path.parent.is_dir():
            path.parent.mkdir(parents=True, exist_ok=True)
            _clear(kind, path.parent)
        write_new(path, _digest(made) + made)
    return made


def _folder(kind: str, key: str) -> Path:
    return user_cache() / f"{kind}-{key}"


def _digest(data: bytes) -> bytes:
    return blake2b(data, digest_size=_DIGEST).digest()


def _clear(kind: str, but: Path) -> None:
    """Take away the folders of other keys that nobody has written to for long."""
    for folder in but.parent.glob(f"{kind}-*"):
        if folder != but and folder.stat().st_mtime < time.time() - _OLD:
            shutil.rmtree(folder, ignore_errors=True)
