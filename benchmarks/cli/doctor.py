"""``er-gym doctor``: what works on this machine."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import EXISTING_FOLDER, Words
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from benchmarks.cli.doctor_checks import Check

_WIDEST = 23
"""Characters of a part's name: of ``platform=CloudRendering``."""


@click.command()
@click.option("--ray", is_flag=True, help="Check a Ray cluster instead, node by node.")
@click.option(
    "--ray-address",
    type=Words(),
    metavar="ADDRESS",
    help="With --ray: the cluster.  [default: start Ray here]",
)
@click.option(
    "--shared-dir",
    type=EXISTING_FOLDER,
    metavar="DIR",
    help="With --ray: a directory that every node is to see under the same path.",
)
def doctor(ray: bool, ray_address: str | None, shared_dir: Path | None) -> int:
    """Check what works on this machine, and say how to fix the rest.

    The exit code is 1 if a part that er-gym always needs does not work; with --ray, if a worker
    does not start on a node of the cluster.
    """
    if not ray:
        if ray_address or shared_dir:
            raise BadInput("--ray-address and --shared-dir are for --ray")
        from benchmarks.cli.doctor_checks import run_checks

        return show_checks(run_checks())
    from benchmarks.cli.doctor_ray import ray_checks

    with bad_input():
        return show_checks(ray_checks(ray_address or "", shared_dir))


def show_checks(checks: Iterable[Check]) -> int:
    """Print each check as soon as it is made."""
    works = True
    for check in checks:
        mark = "ok" if check.works else "--"
        fix = f"; {check.fix}" if check.fix else ""
        echo(f"{mark}  {check.part:{_WIDEST}}  {check.detail}{fix}")
        works = works and (check.works or not check.required)
    return 0 if works else 1
