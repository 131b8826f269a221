"""The directories that the monitor shows, found under the ones that it was given.

A page names a directory by an id. Only what was found has an id, so no path comes from a browser.
"""

from __future__ import annotations

import hashlib
import os
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

Kind: TypeAlias = Literal[
    "run", "collection", "ladder", "ablation", "finetuning", "reinforcement", "policy"
]
MARKERS: dict[str, Kind] = {
    "run.json": "run",
    "collection.json": "collection",
    "ladder.json": "ladder",
    "ablation.json": "ablation",
    "finetune.json": "finetuning",
    "reinforce.json": "reinforcement",
    "curve.jsonl": "policy",
}
"""The file by which a directory of each kind is known."""
_INSIDE = frozenset({"episodes", "conversations", "pictures", "replies", "checkpoints", "parts"})
"""Folders of such directories in which there is nothing more to find."""
_DEEPEST = 6
_MOST = 20_000
"""No more folders are looked at, so that ``er-gym ui /`` ends."""
_FRESH_SECONDS = 2.0


@dataclass(frozen=True)
class Directory:
    """A directory that can be shown.

    Attributes:
        id: names it in addresses, 12 hex digits.
        kind: what it is.
        path: absolute.
        name: its path below the given directory, for people.
    """

    id: str
    kind: Kind
    path: Path
    name: str


class Directories:
    """Finds directories under the given ones, again when asked after a while.

    Args:
        roots: the given directories; links in them are not followed.
    """

    def __init__(self, roots: Sequence[Path]) -> None:
        self.roots = tuple(dict.fromkeys(root.resolve() for root in roots))
        self._lock = threading.Lock()
        self._found: dict[str, Directory] = {}
        self._time = float("-inf")

    def all(self) -> tuple[Directory, ...]:
        """All directories that can be shown, in the order of their names."""
        with self._lock:
            if time.monotonic() - self._time > _FRESH_SECONDS:
                self._found = {directory.id: directory for directory in _find(self.roots)}
                self._time = time.monotonic()
            return tuple(self._found.values())

    def of_kind(self, kind: Kind) -> tuple[Directory, ...]:
        """Those of one kind."""
        return tuple(directory for directory in self.all() if directory.kind == kind)

    def at(self, path: Path, kind: Kind) -> Directory | None:
        """The directory at a path, which may have been made this moment; None if there is none."""
        for _ in range(2):
            for directory in self.of_kind(kind):
                if directory.path == path:
                    return directory
            with self._lock:
                self._time = float("-inf")  # look again
        return None

    def get(self, id: str) -> Directory | None:
        """The directory with this id; None if there is none (any more)."""
        self.all()
        return self._found.get(id)


def _find(roots: Sequence[Path]) -> Iterator[Directory]:
    left = _MOST
    seen: set[Path] = set()
    for root in roots:
        waiting = [(root, 0)]
        while waiting and left:
            folder, depth = waiting.pop()
            if folder in seen:
                continue
            seen.add(folder)
            left -= 1
            names, inner = _listed(folder)
            for marker, kind in MARKERS.items():
                if marker in names:
                    yield _directory(folder, root, kind)
            if depth < _DEEPEST:
                waiting += [
                    (folder / name, depth + 1)
                    for name in sorted(inner, reverse=True)
                    if name not in _INSIDE and not name.startswith(".")
                ]


def _listed(folder: Path) -> tuple[set[str], list[str]]:
    """The names of the files and of the folders in a folder, without links."""
    files, folders = set(), []
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                if entry.is_dir(follow_symlinks=False):
                    folders.append(entry.name)
                elif entry.is_file(follow_symlinks=False):
                    files.add(entry.name)
    except OSError:  # it is gone, or must not be read
        return set(), []
    return files, folders


def _directory(folder: Path, root: Path, kind: Kind) -> Directory:
    name = str(folder.relative_to(root.parent)) if folder != root else root.name
    told = f"{kind}:{folder}".encode(errors="surrogateescape")
    return Directory(hashlib.sha256(told).hexdigest()[:12], kind, folder, printable(name))


def printable(text: str) -> str:
    """A text without characters that cannot be shown or encoded."""
    return "".join(char if char.isprintable() else "�" for char in text)
