"""Finds the pictures of a ShareGPT file that was made elsewhere.

Paths may have backslashes, begin with a folder of another machine, or be relative to a folder above
or below the file's. One rule holds for the whole file, found by its first pictures: the folder that
paths are relative to, and a beginning that is left out. So no picture takes another's place.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

_MOST_BELOW = 50
_ABOVE = 3
"""Folders below the file's, and levels above it, in which pictures are looked for."""
_NO_PATHS = {
    re.compile(r"data:", re.IGNORECASE): "is a picture in the file itself, not the path of one; "
    "save it as a file, and name that",
    re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE): "is an address, not a file; download it "
    "first, and name the file",
}
"""What else stands where a path belongs, and what to do."""


@dataclass(frozen=True)
class PicturePlaces:
    """Where the pictures of a file are.

    Attributes:
        folder: what paths are relative to.
        left_out: a beginning of paths that is left out, without the ``/`` after it; ``""`` for
            none.
    """

    folder: Path
    left_out: str = ""

    def path_of(self, told: str) -> str:
        """The path of a picture, relative to the folder or absolute, whether it is there or not."""
        if os.path.isfile(self.folder / told):
            return told
        plain = told.replace("\\", "/")
        return plain.removeprefix(f"{self.left_out}/") if self.left_out else plain

    def has(self, told: str) -> bool:
        """Whether a picture is there."""
        return os.path.isfile(self.folder / self.path_of(told))

    def missing(self, told: str) -> str:
        """Why there is no picture, in words."""
        for kind, what in _NO_PATHS.items():
            if kind.match(told):
                return f"{told[:80]!r} {what}"
        return f"{self.path_of(told)!r:.160} is not in {self.folder}"

    def lines(self) -> list[str]:
        """What was chosen, for people; nothing where no beginning is left out."""
        if not self.left_out:
            return []
        return [f"pictures are looked up in {self.folder} without {self.left_out + '/'!r:.160}"]


def find_pictures(file: Path, paths: Sequence[str], given: Path | None) -> PicturePlaces:
    """Where the pictures of a file are: where most of some paths lead to a file.

    Args:
        file: the file.
        paths: of its first pictures.
        given: the folder that the user gave; None to look around the file.
    """
    # A picture in the file itself has thousands of parts that look like folders.
    paths = [path for path in paths if not any(kind.match(path) for kind in _NO_PATHS)]
    best, most = PicturePlaces(given or file.parent), 0
    for places in _candidates(file, paths, given):
        found = sum(map(places.has, paths))
        if found > most:
            best, most = places, found
        if most == len(paths):
            break
    return best


def _candidates(file: Path, paths: Sequence[str], given: Path | None) -> Iterator[PicturePlaces]:
    near = [given] if given else [file.parent, *list(file.absolute().parent.parents)[:_ABOVE]]
    near[1:2] = [] if given else [file.parent.parent]  # as the user wrote it
    for folder in near:
        yield PicturePlaces(folder)
    below = [*_below(given or file.parent)]
    for folder in below:
        yield PicturePlaces(folder)
    heads = {beginning for path in paths[:1] for beginning in _beginnings(path)}
    for folder in (*near, *below):
        for head in sorted(heads, key=len):
            yield PicturePlaces(folder, head)


def _beginnings(path: str) -> Iterator[str]:
    """What may be left out of a path: each of its folders with those above."""
    plain = path.replace("\\", "/")
    return (plain[: match.start()] for match in re.finditer("/", plain) if match.start())


def _below(folder: Path) -> Iterator[Path]:
    try:
        names = sorted(each.name for each in os.scandir(folder) if each.is_dir())
    except OSError:
        return
    yield from (folder / name for name in names[:_MOST_BELOW] if not name.startswith("."))
