"""Tries bad command lines, terminals, long texts, foreign files, servers, kills, Gymnasium misused.

    python -m benchmarks.checks.hostile [--quick | --all]

Prints each failure as it is found, then a table: tries, failures and seconds by kind. The exit code
is 1 if there is a failure. Without options it tries some command lines of every command and kind,
and takes less than ten minutes on two idle processors. ``--all`` tries each of them; ``--quick``
fewer, and no whole runs against failing servers.
"""

from __future__ import annotations

from collections.abc import Iterator

import click

from benchmarks.harness.output import print_table
from benchmarks.harness.tally import Tally, end_on_sigterm

_LINES, _QUICK_LINES = 420, 60


@click.command(help=f"\b\n{__doc__}")
@click.option("--quick", is_flag=True, help="Fewer command lines, no whole runs.")
@click.option("--all", "every", is_flag=True, help="Every command line.")
def main(quick: bool, every: bool) -> None:
    if quick and every:
        raise click.UsageError("give --quick or --all")
    end_on_sigterm()
    tallies = []
    for tally in _tallies(_QUICK_LINES if quick else None if every else _LINES):
        click.echo(tally)
        tallies.append(tally)
    rows = [
        (each.what, each.tried, each.failed, f"{each.seconds:.0f}")
        for each in (*tallies, sum(tallies, Tally("in all")))
    ]
    print_table("In all", ("", "tried", "failed", "seconds"), rows)
    raise SystemExit(int(any(tally.failed for tally in tallies)))


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
    main()
