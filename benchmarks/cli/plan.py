"""Runs a plan for a command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import INTERRUPTED, bad_input, print_problem
from benchmarks.cli.executor import ExecutorOptions, with_executor_options
from benchmarks.cli.options import Place, overrides_option
from benchmarks.terminal import echo, terminal

if TYPE_CHECKING:
    from benchmarks.plan.phase import Phase
    from benchmarks.plan.run import Plan


def plan_options(what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The options of a command that runs a plan.

    Args:
        what: the plan's kind, such as ``ladder``, which is also the name of its runs' folder.
    """
    options = (
        click.option(
            "--config",
            required=True,
            metavar="NAME",
            help=f"The {what}: a YAML file, or the name of one of er-gym's own.",
        ),
        overrides_option("evaluation.limit=100"),
        click.option(
            "--out",
            type=Place(file_okay=False, path_type=Path),
            help=f"The {what}'s directory.  [default: runs/{what}/CONFIG]",
        ),
        click.option("--until", metavar="PHASE", help="Stop after this phase."),
        click.option(
            "--print", "only_print", is_flag=True, help="Print the phases and run none of them."
        ),
    )

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        command = with_executor_options(workers=False)(command)
        return reduce(lambda made, option: option(made), reversed(options), command)

    return add


_PLAYS = ("bench", "collect")


def _executed_by(plan: Plan, options: ExecutorOptions) -> Plan:
    """The same plan, its commands that play with these options. Episodes that are selected are
    played again here, since the workers read their run."""
    arguments = tuple(options.arguments())
    phases = [
        replace(phase, command=(*phase.command, *arguments))
        if phase.command[0] in _PLAYS and "--select" not in phase.command
        else phase
        for phase in plan.phases
    ]
    return replace(plan, phases=phases)


def carry_out(
    plan: Plan, out: Path, until: str | None, only_print: bool, options: ExecutorOptions
) -> int:
    """Run the phases of a plan that are not done yet, and tell of each.

    Args:
        plan: the phases.
        out: its directory.
        until: the name of the last phase to run; None for all.
        only_print: print the phases and run none.
        options: where the phases play.

    Returns:
        The exit code, 0 if all went well.

    Raises:
        BadInput: the directory holds another plan, or another process runs it.
    """
    from benchmarks.plan.run import PhaseFailed, PlanError, check_phases, run_plan
    from er_gym.locking import Locked
    from er_gym.plugins import without_imports
    from er_gym.writing import ForeignFile

    plan = _executed_by(plan, options)
    if only_print:
        for phase in plan.phases:
            echo(str(phase))
        with bad_input(PlanError), without_imports():
            unchecked = check_phases(plan.phases)
        for each in unchecked:
            print_problem(f"{each}, since --print runs nothing; it is checked when the plan runs")
        return 0
    console = terminal(stderr=True)

    def tell(phase: Phase, number: int, total: int) -> None:
        console.print(f"[{number}/{total}] {phase.name}", style="bold", markup=False)
        console.print(str(phase), style="dim", soft_wrap=True, markup=False)

    try:
        with bad_input(PlanError, Locked, ForeignFile):
            run_plan(plan, out, click.get_current_context().obj, tell, until)
    except PhaseFailed as error:
        print_problem(f"{error}; the same command continues {out}")
        return error.code
    except KeyboardInterrupt:
        print_problem(f"interrupted; the same command continues {out}")
        return INTERRUPTED
    return 0
