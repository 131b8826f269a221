"""Tries bad command lines, failing servers and misuses of the Gymnasium interface, one after other.

    python -m benchmarks.checks.hostile [--quick | --all]

Prints what falls short as it is found, then a table: what was tried, how often, how much of it
falls short, and the seconds that it took. The exit code is 1 if anything falls short. Without
options it takes less than ten minutes on two processors that have nothing else to do, and tries a
choice of the command lines, of every command and kind; ``--all`` tries each of them, ``--quick`` a
tenth, and neither misuses that take long nor whole runs.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context

from benchmarks.checks import command_lines, misuse, server_faults
from benchmarks.checks.tally import Tally

_LINES, _QUICK_LINES = 420, 60


def main() -> int:
    """Try all, and print what falls short."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="a tenth of it, in a minute")
    size.add_argument("--all", action="store_true", help="every command line")
    given = parser.parse_args()
    lines = _QUICK_LINES if given.quick else None if given.all else _LINES
    parts: list[Callable[[], Tally]] = [
        partial(command_lines.check, (), at_least=lines),
        misuse.check,
        partial(server_faults.check, (), with_runs=not given.quick),
    ]
    tallies = []
    for part in parts:
        # Each in a process of its own: one forks, one starts threads and one catches all that is
        # logged.
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            tallies.append(pool.submit(part).result())
    print(f"\n{'':16} {'tried':>6} {'fall short':>11} {'seconds':>8}")
    for tally in (*tallies, sum(tallies, Tally("in all"))):
        print(f"{tally.what:16} {tally.tried:6} {tally.short:11} {tally.seconds:8.0f}")
    return int(any(tally.short for tally in tallies))


if __name__ == "__main__":
    sys.exit(main())
