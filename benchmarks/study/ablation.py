"""What an ablation has come to: a table for each of its comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from benchmarks.scoring.paired import paired_difference
from benchmarks.study.ablation_phases import row_measured
from benchmarks.study.ablation_settings import AblationSettings, Compared
from benchmarks.study.charts import comparison_chart
from benchmarks.study.results import Part, Result, results_table
from er_gym.tables import Table


def ablation_parts(settings: AblationSettings) -> list[Part]:
    """A part for each comparison."""
    return [
        Part(
            name=name,
            measured=[row_measured(settings, row) for row in study.rows],
            compared=compared,
            tables=partial(_tables, study),
            chart=partial(comparison_chart, study),
            pictured=bool(study.numbers),
        )
        for name, study in settings.studies.items()
    ]


def compared(results: Sequence[Result]) -> list[Result]:
    """The rows, each with its difference in success to the first one over the seeds that both were
    measured with, paired over tasks; None for the first."""
    found = []
    for each in results:
        first, difference = results[0], None
        common = [seed for seed in each.runs if seed in first.runs]
        if each is not first and common:
            difference = paired_difference(first.scores(common), each.scores(common))
        found.append(replace(each, differences={"difference": difference}))
    return found


def _tables(study: Compared, results: Sequence[Result]) -> list[Table]:
    table = results_table(
        f"{study.title}, success in %",
        "row n success interval difference groups seeds",
        results,
        f"difference: to {study.rows[0]}, paired over tasks",
        "by seed: of weights and order of the data",
        may_turn=True,
    )
    return [table]
