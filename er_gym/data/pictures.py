"""Picture files: equal pixels and options give equal bytes.

Every picture of a file is opened here (:func:`open_picture`, :func:`picture_size`,
:func:`check_picture`): only those of the formats that are meant, since some of Pillow's others
start programs or fail in ways of their own, and only up to a number of pixels, which is looked up
before any is decoded.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, JpegImagePlugin

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.reading import open_file

FORMATS = ("JPEG", "PNG", "WEBP", "GIF", "BMP")
"""The formats that are read, by Pillow's names."""
MOST_PIXELS = 1 << 26
"""The most pixels of a picture that is read: 8192 × 8192, 200 MB as RGB."""


class UnusablePicture(ValueError):
    """A picture cannot be read; the message names it, and says why in one line."""


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


@dataclass(frozen=True)
class Encoding:
    """How pictures are written.

    Attributes:
        form: ``jpeg`` or ``png``.
        quality: of a JPEG, 1 to 100.
    """

    form: str
    quality: int

    def of(self, rgb: NDArray[np.uint8]) -> bytes:
        """A picture, (height, width, 3) uint8, as the bytes of a file."""
        return encode_picture(rgb, form=self.form, quality=self.quality)


def encode_alike(rgb: NDArray[np.uint8], like: bytes) -> bytes:
    """A picture as the bytes of a file, of the form and quality that another file has.

    Args:
        rgb: (height, width, 3) uint8.
        like: the other file's bytes; if :func:`encode_picture` wrote it from the same picture, the
            answer is equal to it.

    Raises:
        UnusablePicture: the other file is no picture.
    """
    with _opened(like, "the picture") as other:
        options: dict[str, Any] = {}
        if isinstance(other, JpegImagePlugin.JpegImageFile):
            options["qtables"] = other.quantization
            options["subsampling"] = JpegImagePlugin.get_sampling(other)
        form = str(other.format).lower()
    return _file(rgb, None, form, options)


def difference(recorded: bytes, rgb: NDArray[np.uint8], encoding: Encoding | None = None) -> str:
    """How a recorded picture differs from a newly rendered one, in words; ``""`` if it does not.

    The files need not have equal bytes, as other versions of Pillow write others; their pixels must
    be equal, and so must be the size, the form and the quality. A recorded picture holds nothing by
    which a reader might turn it, either.

    Args:
        recorded: the file's bytes.
        rgb: (height, width, 3) uint8.
        encoding: how it was written; None if that is not known, so that any form and quality will
            do.
    """
    try:
        again = encode_alike(rgb, recorded) if encoding is None else encoding.of(rgb)
        if again == recorded:
            return ""
        ours, theirs = _traits(recorded), _traits(again)
        wrong_traits = [
            f"its {name} is {ours[name]}, not {theirs[name]}"
            for name in ours
            if ours[name] != theirs[name]
        ]
        if wrong_traits:
            return f"is written otherwise: {', '.join(wrong_traits)}"
        # Two steps: a difference of bytes may wrap around.
        apart = np.abs(_pixels(recorded).astype(np.int16) - _pixels(again))
    except ValueError:
        return "is no whole picture"
    wrong = int(apart.any(axis=2).sum())
    if not wrong:
        return ""
    return f"differs in {wrong:,} of {apart[..., 0].size:,} pixels, by up to {int(apart.max())}"


def _traits(data: bytes) -> dict[str, object]:
    """How a picture was written, as far as that changes what is read."""
    with _opened(data, "the picture") as picture:
        tables = getattr(picture, "quantization", None)
        return {
            "form": picture.format,
            "size": "{} x {}".format(*picture.size),
            "mode": picture.mode,
            "table of quality": tables and sum(map(sum, tables.values())),
            "EXIF data": dict(picture.getexif()) or "none",
        }


def open_picture(source: Path | bytes) -> Image.Image:
    """A picture, read as a whole, as RGB.

    Args:
        source: a file, or its bytes.

    Raises:
        UnusablePicture: it is not there, is no picture of one of :data:`FORMATS`, has more than
            :data:`MOST_PIXELS` or 16 bits of grey, or is damaged.
    """
    with _opened(source, _name(source)) as picture:
        return picture.convert("RGB")


def check_picture(source: Path | bytes) -> None:
    """Decode a picture as a whole, and keep nothing of it.

    Raises:
        UnusablePicture: as :func:`open_picture`.
    """
    with _opened(source, _name(source)) as picture:
        picture.load()  # verify() would not notice that the end is missing


def picture_size(source: Path | bytes) -> tuple[int, int]:
    """The width and height of a picture, pixels; only the beginning of its file is read.

    Raises:
        UnusablePicture: as :func:`open_picture`; damage further on is not noticed.
    """
    with _opened(source, _name(source)) as picture:
        return picture.size


@contextmanager
def _opened(source: Path | bytes, name: str) -> Iterator[Image.Image]:
    """A picture whose pixels are not decoded yet; what goes wrong later is told, too."""
    try:
        with BytesIO(source) if isinstance(source, bytes) else open_file(source) as file:
            with warnings.catch_warnings():
                # Pillow's own bound is larger than ours, and has no word on what to do.
                warnings.simplefilter("ignore", Image.DecompressionBombWarning)
                picture = Image.open(file, formats=FORMATS)
            with picture:
                width, height = picture.size
                if width * height > MOST_PIXELS:
                    raise _too_large(name, f"{width:,} × {height:,} = {width * height:,}")
                if picture.mode.startswith("I"):
                    # Pillow makes almost all of it white, and so do the libraries that train.
                    raise UnusablePicture(
                        f"{name}: a picture of 16-bit grey; er-gym reads 8 bits a channel; convert "
                        "it to 8-bit grey or RGB"
                    )
                yield picture
    except UnusablePicture:
        raise
    except Image.DecompressionBombError as error:
        many = re.search(r"\d+", str(error))
        raise _too_large(name, f"{int(many[0]):,}" if many else "far too many") from None
    except TaskFileError as error:
        raise UnusablePicture(f"{error} (it should be a picture)") from None
    except Image.UnidentifiedImageError:
        raise UnusablePicture(
            f"{name}: no picture of a format that er-gym reads: {', '.join(FORMATS)}"
        ) from None
    except Exception as error:  # Pillow's readers fail on broken files in many ways
        why = getattr(error, "strerror", None) or " ".join(str(error).split())
        raise UnusablePicture(f"{name}: a damaged picture: {why or type(error).__name__}") from None


def _too_large(name: str, pixels: str) -> UnusablePicture:
    return UnusablePicture(
        f"{name}: a picture of {pixels} pixels; er-gym reads at most {MOST_PIXELS:,}; make it "
        "smaller"
    )


def _name(source: Path | bytes) -> str:
    return "the picture" if isinstance(source, bytes) else str(source)


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
    return np.asarray(open_picture(data))
