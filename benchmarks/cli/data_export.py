"""``er-gym data export``: a collection as training files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import EXISTING_FILE, FOLDER, LANGUAGES, PATH, split
from benchmarks.terminal import echo, terminal

if TYPE_CHECKING:
    from er_gym.data.exports import ExportSummary


@click.command()
@click.argument("directory", metavar="DIR", type=PATH)
@click.option(
    "--to",
    "format",
    required=True,
    metavar="FORMAT",
    help="sharegpt (LLaMA-Factory), ms-swift, trl, trl-turns, verl, hf, minari, paper, or "
    "package.module:NAME.",
)
@click.option("--out", required=True, type=FOLDER, help="The output folder; new, or empty.")
@click.option(
    "--dialect",
    default="tags",
    show_default=True,
    metavar="NAME|FOLDER",
    help="tags: each thought in its tag; paper: thoughts as running speech.",
)
@click.option(
    "--language",
    type=click.Choice(LANGUAGES),
    help="The language of the prompts.  [default: that of each trajectory's thoughts]",
)
@click.option(
    "--held-out",
    metavar="ROOMS|SHARE",
    help="Rooms for the split validation: FloorPlan1,FloorPlan2; a set, such as evaluation; or a "
    "share of the rooms, such as 0.1.",
)
@click.option(
    "--per-turn",
    is_flag=True,
    help="With sharegpt: one sample for each trained turn of every trajectory.",
)
@click.option(
    "--copy", is_flag=True, help="Copy pictures; else they are hard links where possible."
)
@click.option(
    "--tasks-file",
    type=EXISTING_FILE,
    help="With minari: the task file that was played, if it is no bundled suite.",
)
def export(
    directory: Path,
    format: str,
    out: Path,
    dialect: str,
    language: str | None,
    held_out: str | None,
    per_turn: bool,
    copy: bool,
    tasks_file: Path | None,
) -> None:
    """Write the trajectories of the collection DIR as training files.

    The output holds a README.md that says how the library loads it. docs/data-formats.md compares
    the formats.
    """
    from benchmarks.cli.progress import counting
    from er_gym.data.collection import Collection
    from er_gym.data.exports import EXPORTS, ExportOptions
    from er_gym.data.exports import export as write

    with bad_input():
        name = EXPORTS.get(format).name
        if per_turn and name != "sharegpt":
            raise BadInput(f"--per-turn does not go with --to {name}; leave it out")
        options = ExportOptions(
            dialect=dialect,
            language=language,  # type: ignore[arg-type]  # click has checked it
            held_out=_held_out(held_out),
            per_turn=per_turn,
            copy=copy,
            tasks_file=tasks_file,
        )
        collection = Collection.open(directory)
        with counting(terminal(stderr=True), name) as progress:
            summary = write(collection, format, out, options, progress)
    for line in _lines(summary, out):
        echo(line)


def _held_out(given: str | None) -> tuple[str, ...] | float:
    """Rooms, or a share of them."""
    try:
        return float(given or 0)
    except ValueError:
        return tuple(split(given))


def _lines(summary: ExportSummary, out: Path) -> list[str]:
    """What was written, for people."""
    samples = ", ".join(f"{name} {count:,}" for name, count in sorted(summary.samples.items()))
    lines = [
        f"{out}: {summary.format}, samples: {samples}",
        f"{summary.trajectories:,} trajectories, {summary.turns:,} turns, of which "
        f"{summary.trained_turns:,} are to be learnt; {summary.pictures:,} pictures"
        + (f" ({summary.linked:,} hard links)" if summary.linked else ""),
    ]
    if summary.outside.count:
        lines.append(str(summary.outside))
    lines += [f"left out: {count:,} trajectories: {why}" for why, count in summary.left_out.items()]
    return lines
