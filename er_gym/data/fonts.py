"""Finds a font that has every character of some text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

from PIL import ImageFont

Font: TypeAlias = ImageFont.FreeTypeFont
_NAMES = (
    "DejaVuSans.ttf",
    "NotoSansCJK-Regular.ttc",
    "NotoSansCJKsc-Regular.otf",
    "NotoSansSC-Regular.otf",
    "NotoSansSC-Regular.ttf",
    "SourceHanSansSC-Regular.otf",
    "wqy-microhei.ttc",
    "wqy-zenhei.ttc",
    "DroidSansFallbackFull.ttf",
    "DroidSansFallback.ttf",
    "uming.ttc",
    "PingFang.ttc",
    "Hiragino Sans GB.ttc",
    "Arial Unicode.ttf",
    "msyh.ttc",
    "simhei.ttf",
    "simsun.ttc",
)
"""Fonts that systems have, those with Chinese characters after the first."""
_NO_CHARACTER = "\U0010fffe"
"""No font has it, so it is drawn as a missing character is."""


class NoFont(ValueError):
    """No font has all characters of a text; the message names some, and says what to do."""


def font_for(text: str, size: int, file: Path | None = None) -> Font:
    """A font that has every character of a text.

    Args:
        text: what is to be drawn.
        size: pixels.
        file: the font to use; None for the first that fits, of those that the system has.

    Raises:
        NoFont: none has them all.
        ValueError: the file is no font.
    """
    wanted = {character for character in text if character.isprintable() and character != " "}
    fewest: list[str] | None = None
    for font in _fonts(size, file):
        lacking = sorted(_lacking(font, wanted))
        if not lacking:
            return font
        if fewest is None or len(lacking) < len(fewest):
            fewest = lacking
    some = "".join((fewest or sorted(wanted))[:8])
    which = "no font of this system has all" if file is None else f"{file} lacks some"
    raise NoFont(
        f"{which} characters that the text needs, such as {some}: give a font with --font FILE, "
        "install one such as Noto Sans CJK, or leave out --out to read it in the terminal"
    )


def _fonts(size: int, file: Path | None) -> Iterator[Font]:
    if file is not None:
        try:
            yield ImageFont.truetype(str(file), size)
        except OSError as error:
            raise ValueError(f"{file} is no TrueType or OpenType font") from error
        return
    for name in _NAMES:
        try:
            yield ImageFont.truetype(name, size)
        except OSError:
            continue
    try:
        bundled = ImageFont.load_default(size)  # Pillow's own has Latin letters only
    except (OSError, TypeError):  # Pillow without FreeType, or older than 10.1
        return
    if isinstance(bundled, ImageFont.FreeTypeFont):
        yield bundled


def _lacking(font: Font, characters: Iterable[str]) -> Iterator[str]:
    """The characters that a font draws as it draws one that it lacks."""
    missing = _drawn(font, _NO_CHARACTER)
    return (character for character in characters if _drawn(font, character) == missing)


def _drawn(font: Font, character: str) -> tuple[tuple[int, int], bytes]:
    mask = font.getmask(character, mode="L")
    return mask.size, bytes(mask)
