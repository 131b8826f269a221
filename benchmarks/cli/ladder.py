"""``er-gym ladder``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import bad_input, print_problem
from benchmarks.cli.executor import ExecutorOptions
from benchmarks.cli.plan import carry_out, plan_options
from benchmarks.terminal import echo, stdout

if TYPE_CHECKING:
    from benchmarks.ladder.result import RungResult
    from benchmarks.ladder.settings import LadderSettings


@click.command()
@plan_options("ladder")
def ladder(
    config: str,
    overrides: tuple[str, ...],
    out: Path | None,
    until: str | None,
    only_print: bool,
    executor_options: ExecutorOptions,
) -> int:
    """Climb the paper's ladder: collect, imitate, explore, reflect.

    A model learns in three stages and is measured after each, in rooms that it has not seen. Each
    phase is a command of er-gym, which --print shows. The same command continues a ladder. It ends
    with a table and a picture, beside the paper's.
    """
    from benchmarks.ladder.phases import plan_of
    from benchmarks.ladder.result import read_results
    from benchmarks.ladder.settings import load_ladder

    with bad_input():
        settings = load_ladder(config, overrides)
    out = out or Path("runs") / "ladder" / Path(config).stem
    code = carry_out(plan_of(settings, out), out, until, only_print, executor_options)
    if code or only_print:
        return code
    with bad_input():
        results = read_results(settings, out)
    _show(settings, out, results)
    return 0


def _show(settings: LadderSettings, out: Path, results: list[RungResult]) -> None:
    """Print the tables, and write them and the picture."""
    from benchmarks.ladder.result import as_json, result_tables
    from benchmarks.scoring.tables import as_markdown, print_tables
    from er_gym.writing import write_atomic

    if not results:
        echo(f"no model has been measured yet: {out}")
        return
    tables = result_tables(results)
    print_tables(tables, stdout())
    write_atomic(out / "result.json", as_json(results) + "\n")
    write_atomic(out / "result.md", as_markdown(tables))
    try:
        from benchmarks.ladder.chart import draw_ladder
        from benchmarks.scoring.drawing import write_chart

        figure = draw_ladder(results, f"Success after each stage, {settings.evaluation.suite}")
    except ImportError as error:
        print_problem(str(error))
        return
    write_chart(out / "ladder.png", figure, force=True)
    echo(f"{out / 'result.md'}, {out / 'result.json'}, {out / 'ladder.png'}")
