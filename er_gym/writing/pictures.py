"""Writes pictures and charts, with the mark that says they are er-gym's."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from er_gym.writing.outputs import COMMENT, write_output

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

PICTURE_MARK: Mapping[str, str] = {"Software": "er-gym"}
"""The text chunk of er-gym's PNG files."""


def picture_format(path: Path) -> str:
    """Pillow's name of the picture format of a file name's ending.

    Raises:
        ValueError: no picture format has that ending.
    """
    from PIL.Image import SAVE, registered_extensions

    kind = registered_extensions().get(path.suffix.lower(), "")
    if kind not in SAVE:
        raise ValueError(f"{path}: {path.suffix!r} is not a picture format; give .png or .jpg")
    return kind


def write_picture(path: Path, picture: Image, *, force: bool = False, **options: Any) -> None:
    """Write a picture that the user asked for, in the format of its name's ending.

    Args:
        path: the file.
        picture: what to write.
        force: as in :func:`write_output`.
        options: options of Pillow's writer.

    Raises:
        ForeignFile, CannotWrite: as :func:`write_output`.
        ValueError: there is no such picture format, or it cannot hold this picture.
    """
    from PIL.PngImagePlugin import PngInfo

    kind = picture_format(path)
    if kind == "PNG":
        options["pnginfo"] = PngInfo()
        for name, text in PICTURE_MARK.items():
            options["pnginfo"].add_text(name, text)
    elif kind == "JPEG":
        options["comment"] = COMMENT
    buffer = io.BytesIO()
    try:
        picture.save(buffer, format=kind, **options)
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"{path}: a {kind} file cannot hold this picture: {error}") from error
    write_output(path, buffer.getvalue(), force=force)


def write_figure(path: Path, figure: Figure, *, force: bool = False, **options: Any) -> None:
    """Write a matplotlib figure as PNG.

    Args:
        path: the file.
        figure: what to write.
        force: as in :func:`write_output`.
        options: options of ``savefig``.

    Raises:
        ForeignFile, CannotWrite: as :func:`write_output`.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata=dict(PICTURE_MARK), **options)
    write_output(path, buffer.getvalue(), force=force)
