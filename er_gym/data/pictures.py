"""Picture files: equal pixels and options give equal bytes."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, JpegImagePlugin


def encode_picture(
    rgb: NDArray[np.uint8],
    size: tuple[int, int] | None = None,
    *,
    form: str = "jpeg",
    quality: int = 85,
) -> bytes:
    """A picture as the bytes of a file.

    Args:
        rgb: (height, width, 3) uint8.
        size: width and height in the file, pixels; None for those of the picture.
        form: ``jpeg`` or ``png``.
        quality: of a JPEG, 1 to 100.
    """
    return _file(rgb, size, form, {"quality": quality} if form == "jpeg" else {})


def encode_alike(rgb: NDArray[np.uint8], like: bytes) -> bytes:
    """A picture as the bytes of a file, of the form, size and quality that another file has.

    Args:
        rgb: (height, width, 3) uint8.
        like: the other file's bytes; if :func:`encode_picture` wrote it from the same picture, the
            answer is equal to it.

    Raises:
        OSError: the other file is no picture.
    """
    with Image.open(BytesIO(like)) as other:
        options: dict[str, Any] = {}
        if isinstance(other, JpegImagePlugin.JpegImageFile):
            options["qtables"] = other.quantization
            options["subsampling"] = JpegImagePlugin.get_sampling(other)
        return _file(rgb, other.size, str(other.format).lower(), options)


def difference(recorded: bytes, rgb: NDArray[np.uint8]) -> str:
    """How a recorded picture differs from one that is drawn now, in words; ``""`` if it does not.

    The files need not have equal bytes, as other versions of Pillow write others; their pixels must
    be equal.
    """
    try:
        again = encode_alike(rgb, recorded)
    except (OSError, ValueError):
        return "is no whole picture"
    if again == recorded:
        return ""
    # Two steps: a difference of bytes may wrap around.
    apart = np.abs(_pixels(recorded).astype(np.int16) - _pixels(again))
    wrong = int(apart.any(axis=2).sum())
    if not wrong:
        return ""
    return f"differs in {wrong:,} of {apart[..., 0].size:,} pixels, by up to {int(apart.max())}"


def open_picture(path: Path) -> Image.Image:
    """A picture file, read as a whole.

    Raises:
        ValueError: it is not there, or it is no picture.
    """
    try:
        with Image.open(path) as picture:
            return picture.convert("RGB")
    except (OSError, ValueError, SyntaxError) as error:  # Pillow raises SyntaxError for odd PNGs
        why = getattr(error, "strerror", None) or "it is no picture"
        raise ValueError(f"{path} cannot be shown: {why}") from error


def _file(
    rgb: NDArray[np.uint8], size: tuple[int, int] | None, form: str, options: dict[str, Any]
) -> bytes:
    image = Image.fromarray(rgb)
    if size is not None and size != image.size:
        image = image.resize(size, Image.Resampling.LANCZOS)
    file = BytesIO()
    image.save(file, form, **options)
    return file.getvalue()


def _pixels(data: bytes) -> NDArray[np.uint8]:
    with Image.open(BytesIO(data)) as picture:
        return np.asarray(picture.convert("RGB"))
