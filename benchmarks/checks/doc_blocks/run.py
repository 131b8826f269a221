"""Runs the blocks of a page from top to bottom in one folder, as a reader would.

Each Python block is a fresh process, and each command of a shell block, too. Blocks share files and
nothing else.
"""

from __future__ import annotations

import os
import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.checks.doc_blocks.blocks import PYTHON, SHELL, Block, Part
from benchmarks.checks.doc_blocks.readers import reader
from benchmarks.harness import processes
from benchmarks.harness.output import ROOT

_AT = "DOC_BLOCKS_AT "


@dataclass(frozen=True)
class Ended:
    """A block that was run.

    Attributes:
        place: of the block, or of the command in it that failed.
        problem: in a few lines; ``""`` if there is none.
        seconds: that it took.
    """

    place: str
    problem: str
    seconds: float


def environment(folder: Path) -> dict[str, str]:
    """The environment of a reader whose home is a folder, which is made with its parents."""
    for name in ("home", "tmp"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    kept = {name: value for name, value in os.environ.items() if not name.startswith("ER_GYM_")}
    for name in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "OPENAI_API_KEY"):
        kept.pop(name, None)
    return {
        **kept,
        "HOME": str(folder / "home"),
        "TMPDIR": str(folder / "tmp"),
        "PYTHONPATH": str(ROOT),
        "COLUMNS": "200",
    }


def run(
    blocks: Sequence[Block],
    folder: Path,
    started: Mapping[str, str],
    left_out: Callable[[Part], bool],
    seconds: float,
) -> Iterator[Ended]:
    """Run the blocks of a page.

    Args:
        blocks: of one page, in order.
        folder: where; it exists.
        started: the environment of :func:`~benchmarks.checks.doc_blocks.warm.warm`.
        left_out: whether a part is not to be run.
        seconds: after which a block is killed.
    """
    for block in blocks:
        parts = [part for part in block.parts if not left_out(part)]
        if block.file is not None:
            file = folder / block.file
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.text, encoding="utf-8")
        if not parts:
            continue
        start = time.monotonic()
        at, problem = block.place, ""
        if block.language in SHELL:
            at, problem = _ran(["bash", "-c", _script(parts)], folder, started, seconds)
        elif block.language in PYTHON:
            module = block.file and block.file.removesuffix(".py").replace("/", ".")
            words = ["-m", module] if module else ["-c", block.text]
            problem = _ran([sys.executable, *words], folder, started, seconds)[1]
        else:
            problem = _read(block, folder)
        yield Ended(at or block.place, problem, time.monotonic() - start)


def _script(parts: Sequence[Part]) -> str:
    """A program for bash that says, of the command that fails, where it stands."""
    lines = ["set -eo pipefail", f"trap 'echo {_AT}$at >&2' ERR"]
    for part in parts:
        lines += [f"at={shlex.quote(part.place)}", part.text]
    return "\n".join(lines)


def _ran(
    command: Sequence[str], folder: Path, started: Mapping[str, str], seconds: float
) -> tuple[str, str]:
    """Where a command failed, if it says so, and what it then said."""
    done = processes.run(command, cwd=folder, terminal=False, environment=started, seconds=seconds)
    if done.late:
        return "", f"did not end in {seconds:.0f} s"
    if done.code == 0:
        return "", ""
    told = done.text().splitlines()
    places = [line.removeprefix(_AT) for line in told if line.startswith(_AT)]
    last = [line for line in told if not line.startswith(_AT)][-6:]
    return (places or [""])[-1], "\n  ".join([f"ended with {done.code}", *last])


def _read(block: Block, folder: Path) -> str:
    reads = reader(block)
    if reads is None:
        return f"nothing reads a block of {block.language or 'no language'}; see readers.py"
    try:
        reads(block.text, folder)
    except Exception as error:  # whatever the reader finds
        return f"{type(error).__name__}: {error}"
    return ""
