"""Checks of the arguments of environments and wrappers.

Each check returns the value as a plain Python value, also for a NumPy number. It raises
``ValueError`` with one line that says what was given and what is allowed.
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
    """A value as text for a message: one line, cut short."""
    try:
        text = " ".join(reprlib.repr(value).split())
    except Exception:  # a user's class may have a __repr__ that fails
        text = f"a {type(value).__name__}"
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}..."


def whole_number(name: str, value: Any, least: int, most: int | None = None) -> int:
    """Check a whole number from ``least`` to ``most``; a Boolean is not one."""
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
    """Check a finite number from ``least`` to ``most``; a Boolean is not one.

    Args:
        above: whether the range excludes both ends.
        allowed: what to give, for the message; by default "a number" and the range.
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
    """Check a Boolean."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{name} is {short_repr(value)}; give True or False")
    return bool(value)


def one_of(name: str, value: Any, allowed: Collection[str]) -> str:
    """Check one of the allowed names."""
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
