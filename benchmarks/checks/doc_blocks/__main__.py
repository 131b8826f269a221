"""Runs every block of the documentation, or says why it does not.

    python -m benchmarks.checks.doc_blocks [PAGE …] [--light] [--list] [--times]

The blocks of a page are run from top to bottom in an empty folder, each in a fresh process, with
files of other pages where a page goes on with them (``GIVEN``). Blocks that are no programs are
read by what they are for. ``table.py`` says which parts are not run, and why; ``--list`` prints it.
``--light`` runs what the tests run. Without a page, all are run: half an hour on two idle
processors. Prints the failures; the exit code is 1 if there is one.
"""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from benchmarks.checks.doc_blocks.blocks import Block, Part, blocks
from benchmarks.checks.doc_blocks.readers import ROOT
from benchmarks.checks.doc_blocks.run import Ended, environment, run
from benchmarks.checks.doc_blocks.table import NEVER, SLOW, reason, stale
from benchmarks.checks.doc_blocks.warm import Warm, warm
from benchmarks.checks.tally import Tally

_COLLECTION = "er-gym collect --suite train --limit 12 --out data/x"
_SHAREGPT = (
    "er-gym data export data/x --to sharegpt --out s && cp -r s/pictures . && cp s/train.jsonl"
)
_TASKS = "er-gym tasks convert mini tasks.json"
GIVEN: Mapping[str, tuple[str, ...]] = {
    "README.md": (_TASKS,),
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


def check(
    names: Sequence[str] = (),
    *,
    light: bool = False,
    timed: bool = False,
    say: Callable[[str], None] = print,
) -> Tally:
    """Run the blocks of pages, of all if none is named, and say what failed.

    Args:
        names: pages, such as ``docs/tasks.md``.
        light: whether what is slow is left out, too.
        timed: whether the seconds of each block are said, too.
        say: takes each failure, in a few lines.
    """
    began, tried, short = time.monotonic(), 0, 0
    with tempfile.TemporaryDirectory(prefix="doc-blocks-") as directory:
        for ended in run_pages(Path(directory), names, light=light):
            tried += 1
            if timed:
                say(f"{ended.place}: {ended.seconds:.1f} s")
            if ended.problem:
                short += 1
                say(f"{ended.place}: {ended.problem}")
    return Tally("doc blocks", tried, short, time.monotonic() - began)


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


def _prepared(page: str, place: Path, started: Warm) -> Iterator[Ended]:
    """Make what the reader of a page has already; yields what fails."""
    text = "\n".join(GIVEN.get(page, ()))
    if text:
        made = Block(f"{page} (given)", 0, "sh", text)
        yield from (ended for ended in run([made], place, started, lambda _: False, SECONDS))


def main() -> int:
    """Run the blocks, or print those that are not run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("pages", nargs="*", metavar="PAGE", help="such as docs/tasks.md")
    parser.add_argument("--light", action="store_true", help="only what the tests run")
    parser.add_argument("--list", action="store_true", help="print what is not run, and why")
    parser.add_argument("--times", action="store_true", help="print the seconds of each block")
    given = parser.parse_args()
    every = blocks(ROOT)
    if unknown := {*given.pages} - {block.page for block in every}:
        parser.error(f"{min(unknown)} is no page with a block")
    parts = [part for block in every for part in block.parts]
    for row in stale(parts):
        print(f"table.py: no part begins so: {row}")
    if given.list:
        _print_reasons(parts, given.pages)
        return 0
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    tally = check(
        given.pages,
        light=given.light,
        timed=given.times,
        say=lambda text: print(text, flush=True),
    )
    print(tally)
    return int(tally.short > 0 or bool(stale(parts)))


def _print_reasons(parts: Sequence[Part], pages: Sequence[str]) -> None:
    for what, table in (("never", NEVER), ("only by this check", SLOW)):
        for part in parts:
            why = reason(part, of=(table,))
            if why and (not pages or part.page in pages):
                print(f"{part.place}: {what}: {why}: {part.text.splitlines()[0][:100]}")


if __name__ == "__main__":
    sys.exit(main())
