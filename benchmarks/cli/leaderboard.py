"""``er-gym submit`` and ``er-gym leaderboard``: a run in one file, its check, and the page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import FILE, FOLDER, Words, force_option
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from benchmarks.leaderboard.checking import Checked

SUFFIX = ".jsonl.gz"
"""As in ``benchmarks.leaderboard.submission``, which imports more; a test compares."""
FORGED = 1
"""The exit code of a check that found something."""
_MOST_SHOWN = 20


@click.command()
@click.argument("run", type=FOLDER)
@click.option("--out", type=FILE, required=True, help=f"The file to write; it ends in {SUFFIX}.")
@click.option("--name", type=Words(), default="", help="The agent's name on the board.")
@click.option("--by", type=Words(), default="", help="Who submits.")
@click.option("--hardware", type=Words(), default="", help="What a model ran on, such as 2 x H100.")
@force_option
def submit(run: Path, out: Path, name: str, by: str, hardware: str, force: bool) -> None:
    """Pack a run into one file, for a leaderboard.

    RUN is a run directory of er-gym bench. The file holds the records, the conversations,
    versions, the machine's kind and the costs. It is not written if a text holds what looks like a
    key. Nothing is sent anywhere.
    """
    from benchmarks.leaderboard.packing import pack
    from er_gym.writing import check_output, write_output

    if not out.name.endswith(SUFFIX):
        raise BadInput(f"--out {out}: give a name that ends in {SUFFIX}")
    with bad_input():
        check_output(out, force=force)
        doing(f"packing {run}")
        more = {"model": hardware} if hardware else {}
        data = pack(run, name=name, by=by, hardware=more)
        write_output(out, data, force=force)
    echo(f"{out}: {len(data):,} bytes; `er-gym leaderboard check {out}` checks it")


@click.group()
def leaderboard() -> None:
    """Check submissions, and make the leaderboard's page; docs/leaderboard.md has the rules."""


replay_option = click.option(
    "--replay/--no-replay",
    default=True,
    show_default=True,
    help="Do the actions again on the engine, and compare.",
)


@leaderboard.command(name="check")
@click.argument("files", nargs=-1, required=True, type=FILE, metavar="FILE...")
@replay_option
def check_files(files: tuple[Path, ...], replay: bool) -> int:
    """Check submissions: their results against their records, and their records against the engine.

    Prints what is wrong with each; the exit code is 1 if anything is.
    """
    checked = [_checked(file, replay) for file in files]
    for each in checked:
        if each.problems:
            count = len(each.problems)
            echo(f"{each.path}: refused, {count} problem{'s' * (count > 1)}")
            for problem in each.problems[:_MOST_SHOWN]:
                echo(f"  {problem}")
            if count > _MOST_SHOWN:
                echo(f"  and {count - _MOST_SHOWN} more")
        else:
            assert each.submission is not None
            n = len(each.submission.episodes)
            how = f"{each.replayed} played again" if replay else "none played again"
            echo(f"{each.path}: as it says: {n} episodes, {how}")
        for note in each.notes:
            echo(f"  {note}")
    return FORGED if any(each.problems for each in checked) else 0


@leaderboard.command()
@click.argument("folder", type=FOLDER)
@click.option("--out", type=FILE, help="The page.  [default: index.html in FOLDER]")
@click.option(
    "--month",
    "months",
    type=(str, str, str),
    multiple=True,
    metavar="SUITE MONTH BEACON",
    help="A month's held-out suite, such as er-1k 2026-12 and 64 hex digits; may be repeated.",
)
@replay_option
@force_option
def build(
    folder: Path,
    out: Path | None,
    months: tuple[tuple[str, str, str], ...],
    replay: bool,
    force: bool,
) -> None:
    """Check all submissions in a folder, and write the leaderboard's page.

    A submission with a problem is not listed; the page names it and the problem at its end.
    """
    from benchmarks.leaderboard.board import row
    from benchmarks.leaderboard.months import month_seed
    from benchmarks.leaderboard.page import page
    from er_gym.writing import check_output, write_output

    place = out or folder / "index.html"
    with bad_input():
        named = {f"{each[0]}-fresh-{month_seed(*each)}": each[1] for each in months}
        check_output(place, force=force)
    files = sorted(folder.glob(f"*{SUFFIX}"))
    if not files:
        raise BadInput(f"{folder} holds no file that ends in {SUFFIX}; er-gym submit makes them")
    checked = [_checked(file, replay) for file in files]
    rows = [row(each, named) for each in checked if not each.problems]
    refused = [each for each in checked if each.problems]
    with bad_input():
        write_output(place, page(rows, refused), force=force)
    echo(f"{place}: {len(rows)} submissions listed, {len(refused)} not")


@leaderboard.command()
@click.argument("suite")
@click.argument("month")
@click.argument("beacon")
def month(suite: str, month: str, beacon: str) -> None:
    """Print the command that plays the held-out SUITE of a MONTH, such as 2026-12.

    BEACON is a public random number that is drawn when the month has begun, in 64 hex digits;
    docs/leaderboard.md says which.
    """
    from benchmarks.leaderboard.months import month_seed
    from er_gym.tasks.suites import suite_config

    with bad_input():
        suite_config(suite)
        seed = month_seed(suite, month, beacon)
    echo(f"er-gym bench --suite {suite} --fresh {seed} --instances explore --agent AGENT")


def _checked(file: Path, replay: bool) -> Checked:
    from benchmarks.leaderboard.checking import check
    from benchmarks.leaderboard.suites import board_suite

    doing(f"checking {file}")
    return check(
        file,
        board_suite,
        replay=replay,
        say=lambda done, of: doing(f"checking {file}: {done} of {of} episodes played again"),
    )
