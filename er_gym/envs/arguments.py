"""Checks of what an environment or a wrapper is made with.

Each returns the value as the type that it stands for, so that a NumPy number becomes Python's, and
raises ``ValueError`` with one line: what was given, and what is allowed.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Collection
from numbers import Integral, Real
from typing import Any

import numpy as np

_LONGEST = 80


def short_repr(value: object) -> str:
    """A value for a message: on one line, cut short."""
    try:
        text = " ".join(reprlib.repr(value).split())
    except Exception:  # anybody's class may come here, and its __repr__ may fail
        text = f"a {type(value).__name__}"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> int:
    """A whole number, ``least`` to ``most``; Booleans are none."""
    fits = not isinstance(value, bool) and isinstance(value, Integral)
    if not fits or value < least or (most is not None and value > most):
        raise ValueError(f"{name} is {short_repr(value)}; give a whole number {_span(least, most)}")
    return int(value)


def number(
    name: str,
    value: Any,
    least: float,
    most: float | None = None,
    *,
    above: bool = False,
    allowed: str = "",
) -> float:
    """A finite number, ``least`` to ``most``; Booleans are none.

    ``above``: whether both ends are left out. ``allowed``: what to give, in other words than
    "a number" and the range.
    """
    fits = not isinstance(value, bool) and isinstance(value, Real) and _finite(value)
    if fits:
        low = value > least if above else value >= least
        fits = low and (most is None or (value < most if above else value <= most))
    if not fits:
        allowed = allowed or f"a number {_span(least, most, above)}"
        raise ValueError(f"{name} is {short_repr(value)}; give {allowed}")
    return float(value)


def flag(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} is {short_repr(value)}; give True or False")
    return bool(value)


def one_of(name: str, value: Any, allowed: Collection[str]) -> str:
    """One of some names."""
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"unknown {name} {short_repr(value)}; choose one of: {', '.join(allowed)}")
    return value


def _finite(value: Real) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number that no float holds
        return False


def _span(least: float, most: float | None, above: bool = False) -> str:
    if most is None:
        return f"above {least:g}" if above else f"from {least:g}"
    return f"between {least:g} and {most:g}" if above else f"from {least:g} to {most:g}"
