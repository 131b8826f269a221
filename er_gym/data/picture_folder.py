"""Puts pictures into an output folder: imports and exports link or copy them here."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from er_gym.data.pictures import picture_size
from er_gym.data.trajectory import PictureRecord
from er_gym.writing import inside, make_folder, place_file

_LONGEST_ENDING = 6


@dataclass(frozen=True)
class PicturesElsewhere:
    """Counts the pictures that lie outside the folder in which they are expected.

    Attributes:
        count: how many.
        folder, first: the expected folder, and the path of the first of them.
    """

    count: int = 0
    folder: str = ""
    first: str = ""

    def __str__(self) -> str:
        return f"{self.count:,} pictures lie outside {self.folder}, such as {self.first}"


class PictureFolder:
    """The pictures of an output.

    Attributes:
        folder: of the output.
        pictures, linked: how many there are, and how many of them are hard links.
        outside: the pictures from outside the expected folder.
    """

    def __init__(self, folder: Path, *, copy: bool) -> None:
        self.folder = folder
        self.pictures = self.linked = 0
        self.outside = PicturesElsewhere()
        self._copy = copy

    def place(self, source: Path, to: str | PurePosixPath, within: Path) -> None:
        """Link a picture to a place of the output, or copy it.

        Args:
            source: its file, or a link to it.
            to: its place, relative to the output.
            within: the folder in which it should lie; others are counted.

        Raises:
            OutsideFolder: the place is not in the output.
            CannotWrite: it cannot be written, or something is there already.
            UnusablePicture: it cannot be read afterwards.
        """
        place = inside(self.folder, to)
        make_folder(place.parent)
        self.look(source, within)
        self.linked += place_file(source, place, copy=self._copy)
        self.pictures += 1
        picture_size(place)

    def look(self, source: Path, within: Path) -> None:
        """Count a picture that lies outside the folder in which it should be."""
        top, real = os.path.realpath(within), os.path.realpath(source)
        if not Path(real).is_relative_to(top):
            one = self.outside
            self.outside = replace(one, count=one.count + 1)
            if not one.count:
                self.outside = PicturesElsewhere(1, str(within), real)


def picture_name(stem: str, picture: PictureRecord) -> str:
    """The name of a picture's file in an output: a stem with the ending of the file that it is."""
    ending = PurePosixPath(picture.path.replace("\\", "/")).suffix
    fits = ending[1:].isalnum() and ending.isascii() and len(ending) <= _LONGEST_ENDING
    return f"{stem}{ending if fits else ''}"
