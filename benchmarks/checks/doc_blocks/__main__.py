"""Runs every block of the documentation, or says why it does not.

    python -m benchmarks.checks.doc_blocks [PAGE …] [--light] [--list] [--times]

The blocks of a page are run from top to bottom in an empty folder, each in a fresh process, with
files of other pages where a page goes on with them (``GIVEN``). Blocks that are no programs are
read by what they are for. ``table.py`` says which parts are not run, and why; ``--list`` prints it.
``--light`` runs what the tests run. Without a page, all are run: half an hour on two idle
processors. Prints the failures; the exit code is 1 if there is one.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import click

from benchmarks.checks.doc_blocks.blocks import Block, Part, blocks
from benchmarks.checks.doc_blocks.run import Ended, environment, run
from benchmarks.checks.doc_blocks.table import NEVER, SLOW, reason, stale
from benchmarks.checks.doc_blocks.warm import warm
from benchmarks.harness.output import ROOT
from benchmarks.harness.tally import Tally, Try, end, end_on_sigterm, tally

_COLLECTION = "er-gym collect --suite train --limit 12 --out data/x"
_SHAREGPT = (
    "er-gym data export data/x --to sharegpt --out s && cp -r s/pictures . && cp s/train.jsonl"
)
_TASKS = "er-gym tasks convert mini tasks.json"
GIVEN: Mapping[str, tuple[str, ...]] = {
    "docs/commands.md": (_TASKS,),
    "docs/data-formats.md": (_COLLECTION, f"{_SHAREGPT} train.json"),
    "docs/data.md": (
        "er-gym bench --suite train --limit 12 --agent searcher --samples 2 --out runs/s1-samples",
    ),
    "docs/finetuning-clusters.md": (_COLLECTION,),
    "docs/monitor.md": ("er-gym bench --suite mini --limit 3 --agent random --out runs/x",),
}
"""What the reader of a page has already: the commands that make it."""
LIGHT_SECONDS, SECONDS = 120.0, 1_800.0
"""After which a block is killed, on a busy machine."""


def check(names: Sequence[str] = (), *, light: bool = False, timed: bool = False) -> Tally:
    """Run the blocks of pages, of all if none is named, and say what failed.

    Args:
        names: pages, such as ``docs/tasks.md``.
        light: whether what is slow is left out, too.
        timed: whether the seconds of each block are said, too.
    """
    return tally("doc blocks", _tries(names, light, timed))


def _tries(names: Sequence[str], light: bool, timed: bool) -> Iterator[Try]:
    with tempfile.TemporaryDirectory(prefix="doc-blocks-") as directory:
        for ended in run_pages(Path(directory), names, light=light):
            if timed:
                click.echo(f"{ended.place}: {ended.seconds:.1f} s")
            yield ended.place, [ended.problem] if ended.problem else []


def run_pages(folder: Path, names: Sequence[str] = (), *, light: bool = False) -> Iterator[Ended]:
    """Run the blocks of pages in a folder, which must exist; see :func:`check`."""
    tables = (NEVER, SLOW) if light else (NEVER,)
    pages: dict[str, list[Block]] = {}
    for block in blocks(ROOT):
        if not names or block.page in names:
            pages.setdefault(block.page, []).append(block)
    given = environment(folder)
    with warm(folder / "bin", given) as started:
        for number, (page, found) in enumerate(pages.items()):
            place = folder / str(number)
            place.mkdir()
            if not light:
                yield from _prepared(page, place, started)
            limit = LIGHT_SECONDS if light else SECONDS
            yield from run(found, place, started, lambda part: bool(reason(part, of=tables)), limit)
            shutil.rmtree(place, ignore_errors=True)


def _prepared(page: str, place: Path, started: Mapping[str, str]) -> Iterator[Ended]:
    """Make what the reader of a page has already; yields what fails."""
    text = "\n".join(GIVEN.get(page, ()))
    if text:
        made = Block(f"{page} (given)", 0, "sh", text)
        yield from (ended for ended in run([made], place, started, lambda _: False, SECONDS))


@click.command(help=f"\b\n{__doc__}")
@click.argument("pages", nargs=-1, metavar="[PAGE]...")
@click.option("--light", is_flag=True, help="Only what the tests run.")
@click.option("--list", "listed", is_flag=True, help="Print what is not run, and why.")
@click.option("--times", is_flag=True, help="Print the seconds of each block.")
def main(pages: tuple[str, ...], light: bool, listed: bool, times: bool) -> None:
    every = blocks(ROOT)
    if unknown := {*pages} - {block.page for block in every}:
        raise click.UsageError(f"{min(unknown)} is no page with a block")
    parts = [part for block in every for part in block.parts]
    rows = stale(parts)
    for row in rows:
        click.echo(f"table.py: no part begins so: {row}")
    if listed:
        _print_reasons(parts, pages)
        return
    end_on_sigterm()
    end(check(pages, light=light, timed=times) + Tally("stale rows", failed=len(rows)))


def _print_reasons(parts: Sequence[Part], pages: Sequence[str]) -> None:
    for what, table in (("never", NEVER), ("only by this check", SLOW)):
        for part in parts:
            why = reason(part, of=(table,))
            if why and (not pages or part.page in pages):
                click.echo(f"{part.place}: {what}: {why}: {part.text.splitlines()[0][:100]}")


if __name__ == "__main__":
    main()
