"""The seed of a month's held-out suite.

A suite is made anew each month from a seed that nobody can know before the month begins, so nobody
can have trained or chosen on it. The seed follows from the suite, the month and a *beacon*: a
public random number that is drawn after the month has begun (docs/leaderboard.md says which).
"""

from __future__ import annotations

import hashlib
import re

_MONTH = re.compile(r"20\d\d-(0[1-9]|1[0-2])\Z")
_BEACON = re.compile(r"[0-9a-f]{64}\Z")
_FRESH = re.compile(r"(?P<suite>.+)-fresh-(?P<seed>\d{1,10})\Z")


def month_seed(suite: str, month: str, beacon: str) -> int:
    """The seed of a suite's tasks of a month, in [0, 2**31).

    Args:
        suite: the suite whose configuration says what is made.
        month: as ``2026-12``.
        beacon: 64 hex digits.

    Raises:
        ValueError: the month or the beacon is none.
    """
    if not _MONTH.match(month):
        raise ValueError(f"{month!r:.40} is no month; write one such as 2026-12")
    if not _BEACON.match(beacon):
        raise ValueError(f"{beacon!r:.80} is no beacon; give its 64 hex digits, in lower case")
    told = f"er-gym leaderboard 1: {suite} {month} {beacon}"
    return int.from_bytes(hashlib.sha256(told.encode()).digest()[:4], "big") >> 1


def fresh_of(name: str) -> tuple[str, int] | None:
    """The suite and the seed in the name of fresh tasks (``er-1k-fresh-7``); None for others."""
    found = _FRESH.match(name)
    return None if found is None else (found["suite"], int(found["seed"]))
