"""``er-gym ladder`` and ``er-gym ablate``: the two kinds of studies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import INTERRUPTED, bad_input, print_problem
from benchmarks.cli.executor import ExecutorOptions, with_executor_options
from benchmarks.cli.options import NonEmptyPath, overrides_option
from benchmarks.terminal import echo, stdout, terminal

if TYPE_CHECKING:
    from benchmarks.study.kinds import Study
    from benchmarks.study.phase import Phase
    from benchmarks.study.run import Plan


def _study(name: str, what: str, about: str) -> click.Command:
    """A command that runs a kind of study.

    Args:
        name: of the command.
        what: the kind (:data:`benchmarks.study.kinds.KINDS`), also the name of its runs' folder.
        about: its help.
    """

    @click.command(name, help=about)
    @click.option(
        "--config",
        required=True,
        metavar="NAME",
        help=f"The {what}: a YAML file, or the name of one of er-gym's own.",
    )
    @overrides_option("evaluation.limit=100")
    @click.option(
        "--out",
        type=NonEmptyPath(file_okay=False, path_type=Path),
        help=f"The {what}'s directory.  [default: runs/{what}/CONFIG]",
    )
    @click.option("--until", metavar="PHASE", help="Stop after this phase.")
    @click.option(
        "--print", "only_print", is_flag=True, help="Print the phases and run none of them."
    )
    @with_executor_options(workers=False)
    def run(
        config: str,
        overrides: tuple[str, ...],
        out: Path | None,
        until: str | None,
        only_print: bool,
        executor_options: ExecutorOptions,
    ) -> int:
        from benchmarks.study.kinds import KINDS, Study

        with bad_input():
            settings = KINDS[what].load(config, overrides)
        study = Study(KINDS[what], out or Path("runs") / what / Path(config).stem, settings)
        plan = _executed_by(study.plan, executor_options)
        if only_print:
            return _print(plan)
        code = _carry_out(plan, study.path, until)
        if not code:
            _show(study)
        return code

    return run


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


def _print(plan: Plan) -> int:
    """Print the phases of a plan and run none."""
    from benchmarks.study.run import PlanError, check_phases
    from er_gym.plugins import without_imports

    for phase in plan.phases:
        echo(str(phase))
    with bad_input(PlanError), without_imports():
        unchecked = check_phases(plan.phases, only_print=True)
    for each in unchecked:
        print_problem(f"{each}; this is checked when the plan runs")
    return 0


def _carry_out(plan: Plan, out: Path, until: str | None) -> int:
    """Run the phases of a plan that are not done yet, and tell of each.

    Args:
        plan: the phases.
        out: its directory.
        until: the name of the last phase to run; None for all.

    Returns:
        The exit code, 0 if all went well.

    Raises:
        BadInput: the directory holds another plan, or another process runs it.
    """
    from benchmarks.study.run import PhaseFailed, PlanError, run_plan
    from er_gym.locking import Locked
    from er_gym.writing import ForeignFile

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


def _show(study: Study) -> None:
    """Print the tables, and write them, the figures and the pictures."""
    from benchmarks.scoring.tables import print_tables

    with bad_input():
        found = study.results()
    if not found:
        echo(f"no model has been measured yet: {study.path}")
        return
    print_tables([table for part, results in found for table in part.tables(results)], stdout())
    files = study.write(found)
    try:
        from benchmarks.scoring.drawing import draw, write_charts

        drawn = {part.name: draw(part.picture(results)) for part, results in found if part.pictured}
        files += write_charts(study.path, drawn, force=True)
    except ImportError as error:
        print_problem(str(error))
    echo(", ".join(map(str, files)))


ladder = _study(
    "ladder",
    "ladder",
    """Train a model in the paper's three stages: imitation, exploration, reflection.

    The model is evaluated after each stage, in rooms that it has not seen. Each phase is a command
    of er-gym, which --print shows. The same command continues a ladder. At the end it writes a
    table and a picture, with the paper's figures beside.
    """,
)
ablate = _study(
    "ablate",
    "ablation",
    """Train many small models, each without some part, and compare them.

    Each phase is a command of er-gym, which --print shows. The same command continues an ablation.
    At the end it writes a table for each study, with all rows that have been measured.
    """,
)
