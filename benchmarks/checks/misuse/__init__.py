"""Misuses the Gymnasium interface in some 600 ways, and checks how it answers.

    python -m benchmarks.checks.misuse [WORD …]

Each try is a misuse, or a correct use that is easily broken. A misuse must raise the named error,
with a message of one line and at most 500 characters. A correct use must not raise, and must give
the stated result. Only tries whose names hold the given words are run. Prints the failures; the
exit code is 1 if there is one. Takes half a minute.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence

from benchmarks.checks.misuse.episodes import copies, handed_out, out_of_turn
from benchmarks.checks.misuse.tries import Try
from benchmarks.checks.misuse.values import actions, arguments, resets
from benchmarks.checks.misuse.wrapping import orders, registry, vectors
from benchmarks.harness.tally import Tally, has_words, tally

_LONGEST = 500
"""Characters of a message."""
GROUPS = (actions, arguments, out_of_turn, resets, copies, handed_out, orders, registry, vectors)


def check(words: Sequence[str] = ()) -> Tally:
    """Try all whose names hold the words, and print the failures."""
    warnings.simplefilter("ignore")
    every = (each for group in GROUPS for each in group() if has_words(each.name, words))
    return tally("misuses", ((each.name, _problems(each)) for each in every))


def _problems(each: Try) -> Iterator[str]:
    try:
        each.do()
    except Exception as caught:  # any exception is compared with the expected one
        said = str(caught)
        if each.raises is None or not isinstance(caught, each.raises):
            yield f"{type(caught).__name__}: {said[:300]}"
        elif len(said) > _LONGEST or "\n" in said:
            yield f"its message is too long, or has several lines: {said[:300]!r}"
        elif each.says not in said:
            yield f"does not say {each.says!r}: {said}"
    else:
        if each.raises is not None:
            yield "no error"
