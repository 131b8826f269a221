"""``er-gym ablate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import bad_input, print_problem
from benchmarks.cli.executor import ExecutorOptions
from benchmarks.cli.plan import carry_out, plan_options
from benchmarks.terminal import echo, stdout

if TYPE_CHECKING:
    from benchmarks.ablation.result import RowResult
    from benchmarks.ablation.settings import AblationSettings


@click.command()
@plan_options("ablation")
def ablate(
    config: str,
    overrides: tuple[str, ...],
    out: Path | None,
    until: str | None,
    only_print: bool,
    executor_options: ExecutorOptions,
) -> int:
    """Train many small models, each without some part, and compare them.

    Each phase is a command of er-gym, which --print shows. The same command continues an ablation.
    It ends with a table for each study, of all rows that have been measured.
    """
    from benchmarks.ablation.phases import plan_of
    from benchmarks.ablation.result import read_study
    from benchmarks.ablation.settings import load_ablation

    with bad_input():
        settings = load_ablation(config, overrides)
    out = out or Path("runs") / "ablation" / Path(config).stem
    code = carry_out(plan_of(settings, out), out, until, only_print, executor_options)
    if code or only_print:
        return code
    with bad_input():
        results = {
            name: read_study(settings, study, out) for name, study in settings.studies.items()
        }
    _show(settings, out, {name: rows for name, rows in results.items() if rows})
    return 0


def _show(settings: AblationSettings, out: Path, results: dict[str, list[RowResult]]) -> None:
    """Print the tables, and write them and the pictures."""
    from benchmarks.ablation.result import as_json, study_table
    from benchmarks.scoring.tables import as_markdown, print_tables
    from er_gym.writing import write_atomic

    if not results:
        echo(f"no model has been measured yet: {out}")
        return
    tables = [study_table(settings.studies[name], rows) for name, rows in results.items()]
    print_tables(tables, stdout())
    files = [out / "result.md", out / "result.json"]
    write_atomic(files[0], as_markdown(tables))
    write_atomic(files[1], as_json(results) + "\n")
    drawn = {name: rows for name, rows in results.items() if settings.studies[name].numbers}
    try:
        from benchmarks.ablation.chart import draw_study
        from benchmarks.scoring.drawing import write_chart

        for name, rows in drawn.items():
            files.append(out / f"{name}.png")
            write_chart(files[-1], draw_study(settings.studies[name], rows), force=True)
    except ImportError as error:
        print_problem(str(error))
        files = files[:2]
    echo(", ".join(map(str, files)))
