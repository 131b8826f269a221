"""``er-gym data import``: a ShareGPT file as a collection of trajectories."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import bad_input, print_problem
from benchmarks.cli.options import FOLDER, PATH
from benchmarks.terminal import echo, terminal


@click.command(name="import")
@click.argument("file", metavar="FILE", type=PATH)
@click.option("--out", required=True, type=FOLDER, help="The collection; new, or empty.")
@click.option(
    "--pictures",
    type=FOLDER,
    help="What the paths of pictures are relative to.  [default: the file's folder]",
)
@click.option(
    "--dataset",
    default="",
    metavar="NAME",
    help="The entry of dataset_info.json, if FILE is one that has several, its folder, or a data "
    "file with several entries there.",
)
@click.option("--leave-out", is_flag=True, help="Leave out samples that have problems.")
@click.option(
    "--copy", is_flag=True, help="Copy pictures; else they are hard links where possible."
)
def import_(
    file: Path, out: Path, pictures: Path | None, dataset: str, leave_out: bool, copy: bool
) -> None:
    """Turn a ShareGPT file with pictures, such as the paper's, into trajectories.

    Thoughts are split at their tags, or at the phrases with which they begin; actions are read from
    <DecisionMaking>. Fields that the file lacks, such as poses and key actions, stay empty: er-gym
    data stats, show and export work on the result, verify does not.
    """
    from benchmarks.cli.progress import counting
    from er_gym.data.sharegpt_files import open_sharegpt
    from er_gym.data.sharegpt_import import LEFT_OUT, import_sharegpt
    from er_gym.writing import check_folder

    with bad_input():
        check_folder(out)
        doing(f"reading {file}")
        opened = open_sharegpt(
            file,
            dataset=dataset,
            pictures=pictures,
            decisions=True,
            decode=True,
            leave_out=leave_out,
        )
        first, *problems = opened.report.lines()
        for line in (*opened.places.lines(), *problems):
            print_problem(line)
        with counting(terminal(stderr=True), "import") as progress:
            summary = import_sharegpt(opened, out, copy=copy, progress=progress)
    echo(first)
    parts = ", ".join(f"{part} {count:,}" for part, count in summary.parts.items())
    echo(
        f"{out}: {summary.trajectories:,} trajectories ({parts}), {summary.turns:,} turns, of "
        f"which {summary.trained_turns:,} are to be learnt; {summary.pictures:,} pictures"
    )
    if summary.outside.count:
        echo(str(summary.outside))
    if summary.left_out:
        echo(f"{summary.left_out:,} samples are left out; {out / LEFT_OUT} names each, and why")
    if summary.without_scene:
        echo(f"{summary.without_scene:,} trajectories do not say in which room they were played")
