"""Misuses the Gymnasium interface in some 600 ways, and checks how it answers.

    python -m benchmarks.checks.misuse [WORD …]

Each try is a misuse, or a correct use that is easily broken. A misuse must raise the named error,
with a message of one line and at most 400 characters. A correct use must not raise, and must give
the stated result. Only tries whose names hold the given words are run. Prints the failures; the
exit code is 1 if there is one. Takes half a minute.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence

from benchmarks.checks.misuse.episodes import copies, handed_out, out_of_turn
from benchmarks.checks.misuse.tries import Try
from benchmarks.checks.misuse.values import actions, arguments, resets
from benchmarks.checks.misuse.wrapping import orders, registry, vectors
from benchmarks.checks.tally import Tally

_LONGEST = 500
"""Characters of a message."""
GROUPS = (actions, arguments, out_of_turn, resets, copies, handed_out, orders, registry, vectors)


def check(words: Sequence[str] = ()) -> Tally:
    """Try all whose names hold the words, and print the failures."""
    warnings.simplefilter("ignore")
    began = time.monotonic()
    count = short = 0
    for group in GROUPS:
        for each in group():
            if all(word in each.name for word in words):
                count += 1
                problem = _problem(each)
                if problem:
                    short += 1
                    print(f"{each.name}: {problem}", flush=True)
    return Tally("misuses", count, short, time.monotonic() - began)


def main(words: Sequence[str]) -> int:
    """Try all; print the failures and their number."""
    tally = check(words)
    print(tally)
    return int(tally.short > 0)


def _problem(each: Try) -> str:
    """The problem of a try, "" if there is none."""
    try:
        each.do()
    except Exception as caught:  # any exception is compared with the expected one
        said = str(caught)
        if each.raises is None or not isinstance(caught, each.raises):
            return f"{type(caught).__name__}: {said[:300]}"
        if len(said) > _LONGEST or "\n" in said:
            return f"its message is too long, or has several lines: {said[:300]!r}"
        return "" if each.says in said else f"does not say {each.says!r}: {said}"
    return "" if each.raises is None else "no error"
