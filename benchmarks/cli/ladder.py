"""``er-gym ladder``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import INTERRUPTED, bad_input, print_problem
from benchmarks.cli.options import Place, overrides_option
from benchmarks.cli.terminal import echo, stdout, terminal

if TYPE_CHECKING:
    from benchmarks.ladder.phases import Phase
    from benchmarks.ladder.result import RungResult
    from benchmarks.ladder.settings import LadderSettings


@click.command()
@click.option(
    "--config",
    required=True,
    metavar="NAME",
    help="The ladder: a YAML file, or the name of one of er-gym's own.",
)
@overrides_option("evaluation.limit=100")
@click.option(
    "--out",
    type=Place(file_okay=False, path_type=Path),
    help="The ladder's directory.  [default: runs/ladder/CONFIG]",
)
@click.option("--until", metavar="PHASE", help="Stop after this phase.")
@click.option("--print", "only_print", is_flag=True, help="Print the phases and run none of them.")
def ladder(
    config: str, overrides: tuple[str, ...], out: Path | None, until: str | None, only_print: bool
) -> int:
    """Climb the paper's ladder: collect, imitate, explore, reflect.

    A model learns in three stages and is measured after each, in rooms that it has not seen. Each
    phase is a command of er-gym, which --print shows. The same command continues a ladder. It ends
    with a table and a picture, beside the paper's.
    """
    from benchmarks.ladder.climb import LadderError, PhaseFailed, climb
    from benchmarks.ladder.phases import phases
    from benchmarks.ladder.result import read_results
    from benchmarks.ladder.settings import load_ladder
    from er_gym import __version__
    from er_gym.locking import Locked
    from er_gym.writing import ForeignFile

    console = terminal(stderr=True)
    with bad_input():
        settings = load_ladder(config, overrides)
    out = out or Path("runs") / "ladder" / Path(config).stem
    if only_print:
        for phase in phases(settings, out):
            echo(str(phase))
        return 0

    def tell(phase: Phase, number: int, total: int) -> None:
        console.print(f"[{number}/{total}] {phase.name}", style="bold", markup=False)
        console.print(str(phase), style="dim", soft_wrap=True, markup=False)

    try:
        with bad_input(LadderError, Locked, ForeignFile):
            climb(settings, out, __version__, tell, until)
    except PhaseFailed as error:
        print_problem(f"{error}; the same command continues {out}")
        return error.code
    except KeyboardInterrupt:
        print_problem(f"interrupted; the same command continues {out}")
        return INTERRUPTED
    with bad_input():
        results = read_results(settings, out)
    _show(settings, out, results)
    return 0


def _show(settings: LadderSettings, out: Path, results: list[RungResult]) -> None:
    """Print the tables, and write them and the picture."""
    from benchmarks.ladder.result import as_json, result_tables
    from benchmarks.scoring.tables import as_markdown, print_tables
    from er_gym.writing import write_atomic, write_figure

    if not results:
        echo(f"no model has been measured yet: {out}")
        return
    tables = result_tables(results)
    print_tables(tables, stdout())
    write_atomic(out / "result.json", as_json(results) + "\n")
    write_atomic(out / "result.md", as_markdown(tables))
    try:
        from benchmarks.ladder.chart import draw_ladder

        figure = draw_ladder(results, f"Success after each stage, {settings.evaluation.suite}")
    except ImportError:
        print_problem("pictures need matplotlib: pip install 'er-gym[charts]'")
        return
    write_figure(out / "ladder.png", figure, force=True)
    echo(f"{out / 'result.md'}, {out / 'result.json'}, {out / 'ladder.png'}")
