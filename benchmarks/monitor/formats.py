"""How the pages write figures."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from typing import Any

from markupsafe import Markup


def percent(rate: float | None) -> str:
    """A fraction in %, with one decimal place."""
    return "–" if rate is None else f"{100 * rate:.1f} %"


def signed(rate: float) -> str:
    """A difference of fractions in percentage points, with its sign."""
    return f"{100 * rate:+.1f}".replace("-", "−")


def chance(p: float) -> str:
    """A p value, with two digits that say something."""
    return "< 0.0001" if p < 1e-4 else f"{p:.2g}"


def duration(seconds: float | None) -> str:
    """``1:02:03``."""
    if seconds is None:
        return "–"
    whole = max(0, round(seconds))
    return f"{whole // 3600}:{whole // 60 % 60:02}:{whole % 60:02}"


def moment(seconds: float | None) -> str:
    """A time since the epoch, as this machine's clock shows it."""
    return "–" if not seconds else time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(seconds))


def count(number: float) -> str:
    """A whole number with commas."""
    return f"{number:,.0f}"


def money(dollars: float) -> str:
    """US dollars."""
    return f"${dollars:,.2f}" if dollars else "–"


def visible(text: str, most: int = 200_000) -> str:
    """A text in which characters that turn or hide text can be seen.

    A model can say them, and could so make a page look like another: bidirectional controls, and
    other characters without a shape, are written as their code points. So are marks over one
    letter beyond the fourth, which would cover the lines above. Of a longer text than ``most`` the
    rest is left out.
    """
    shown = "".join(char if _is_plain(char) else f"⟨U+{ord(char):04X}⟩" for char in text[:most])
    shown = _MARKS.sub(_counted_marks, shown)
    return shown + " …" if len(text) > most else shown


def pieces(text: str) -> list[str]:
    """A long text in pieces that a browser lays out one by one, parted between words."""
    found = []
    while len(text) > _PIECE:
        at = max(text.rfind(gap, _PIECE // 2, _PIECE) for gap in ("\n", " ")) + 1 or _PIECE
        found.append(text[:at])
        text = text[at:]
    return [*found, text]


def brief(text: str) -> str:
    """As :func:`visible`, for what is usually a line."""
    return visible(text, 2_000)


def path(text: str) -> Markup:
    """As :func:`brief`, for a path or a name: it may be parted behind each slash and underscore."""
    return Markup("<wbr>").join(_PARTED.split(brief(text)))


_PIECE = 4_000
_PARTED = re.compile("(?<=[/_])(?=[^/_])")
_MARK = "[\u0300-\u036f\u0483-\u0489\u1ab0-\u1aff\u1dc0-\u1dff\u20d0-\u20ff\ufe20-\ufe2f]"
_MARKS = re.compile(f"(?<={_MARK}{{4}}){_MARK}+")
"""Combining marks beyond the fourth in a row."""


def _counted_marks(marks: re.Match[str]) -> str:
    return f"⟨U+{ord(marks[0][0]):04X} …{len(marks[0])}⟩"


def _is_plain(char: str) -> bool:
    return char.isprintable() or char in "\n\t"


FILTERS: Mapping[str, Callable[..., Any]] = {
    "percent": percent,
    "signed": signed,
    "chance": chance,
    "duration": duration,
    "moment": moment,
    "count": count,
    "money": money,
    "visible": visible,
    "pieces": pieces,
    "brief": brief,
    "path": path,
}
"""The functions by their names in templates."""
