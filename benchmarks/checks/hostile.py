"""Tries bad command lines, terminals, long texts, foreign files, servers, kills, Gymnasium misused.

    python -m benchmarks.checks.hostile [--quick | --all]

Prints each failure as it is found, then a table: tries, failures and seconds by kind. The exit code
is 1 if there is a failure. Without options it tries some command lines of every command and kind,
and takes less than ten minutes on two idle processors. ``--all`` tries each of them; ``--quick``
fewer, and no whole runs against failing servers.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Iterator

from benchmarks.checks.tally import Tally

_LINES, _QUICK_LINES = 420, 60


def main() -> int:
    """Try everything, and print the failures."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="fewer command lines, no whole runs")
    size.add_argument("--all", action="store_true", help="every command line")
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    tallies = []
    for tally in _tallies(_QUICK_LINES if given.quick else None if given.all else _LINES):
        print(tally, flush=True)
        tallies.append(tally)
    print(f"\n{'':16} {'tried':>6} {'fall short':>11} {'seconds':>8}")
    for tally in (*tallies, sum(tallies, Tally("in all"))):
        print(f"{tally.what:16} {tally.tried:6} {tally.short:11} {tally.seconds:8.0f}")
    return int(any(tally.short for tally in tallies))


def _tallies(lines: int | None) -> Iterator[Tally]:
    # The first check forks, so it runs before the others, which start threads.
    from benchmarks.checks import command_lines

    yield command_lines.check((), at_least=lines)
    from benchmarks.checks import foreign_files, long_texts, misuse, server_faults, terminals

    yield long_texts.check(framed=lines is None)
    yield terminals.check(quick=lines == _QUICK_LINES)
    yield misuse.check()
    yield foreign_files.check()
    yield server_faults.check((), with_runs=lines != _QUICK_LINES)
    if lines != _QUICK_LINES:
        from benchmarks.checks import side_logs

        yield side_logs.check()


if __name__ == "__main__":
    sys.exit(main())
