"""What a ladder has come to: tables, beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from agents.finetune.settings import STAGES
from benchmarks.scoring.metrics import Estimate
from benchmarks.scoring.paired import paired_change, paired_difference
from benchmarks.scoring.tables import NONE
from benchmarks.study.charts import ladder_chart
from benchmarks.study.ladder_phases import rungs
from benchmarks.study.ladder_settings import CONTROLS, LadderSettings
from benchmarks.study.paper_rungs import PAPER
from benchmarks.study.results import Part, Result, results_table
from er_gym.tables import Table


def ladder_parts(settings: LadderSettings) -> list[Part]:
    """All rungs, in one part."""
    title = f"Success after each stage, {settings.evaluation.suite}"
    return [
        Part(
            name="ladder",
            measured=rungs(settings),
            compared=compared,
            tables=ladder_tables,
            chart=partial(ladder_chart, title),
            pictured=True,
        )
    ]


def compared(results: Sequence[Result]) -> list[Result]:
    """The rungs with their differences, each paired over tasks.

    ``gain``: in success to the rung before, of a control to the last rung. ``change``: with faults,
    in success to the same rung without them. ``loss_reduction``: how much smaller a loss that is
    than the rung's before. ``more_repeats``, ``more_revisits``: in
    :func:`~benchmarks.scoring.metrics.repeat_rate` and ``revisit_rate`` to the first stage measured
    with as many faults.
    """
    found: list[Result] = []
    before: dict[float, Result] = {}
    first_stages: dict[float, Result] = {}
    without_faults = {each.name: each for each in results if not each.of.faults}
    lost: dict[float, tuple[Result, Result]] = {}
    for each in results:
        faults = each.of.faults
        stage = each.name in STAGES
        first = first_stages.setdefault(faults, each) if stage else None
        plain = without_faults.get(each.name) if faults else None
        differences = {
            "gain": _difference(before.get(faults), each),
            "change": _difference(plain, each),
            "loss_reduction": None,
            "more_repeats": _difference(first, each, "repeat_rate"),
            "more_revisits": _difference(first, each, "revisit_rate"),
        }
        if plain is not None:
            if faults in lost:
                earlier, later = lost[faults]
                differences["loss_reduction"] = paired_change(
                    (earlier.scores(), later.scores()), (plain.scores(), each.scores())
                )
            lost[faults] = plain, each
        found.append(replace(each, differences=differences))
        if each.name not in CONTROLS:
            before[faults] = each
    return found


def _difference(first: Result | None, second: Result, metric: str = "success") -> Estimate | None:
    if first is None or first is second:
        return None
    return paired_difference(first.scores(), second.scores(), metric)


def ladder_tables(results: Sequence[Result]) -> list[Table]:
    """The results as tables: the rungs beside the paper's, and success by key actions."""
    names = [each.name for each in results if not each.of.faults]
    every = results_table(
        "The ladder, in %",
        "rung n success interval gain search_efficiency completeness groups repeat_rate tokens",
        results,
        "gain: in success over the rung above it, paired over tasks; of random and blind, "
        "over the last rung",
        "SE: search efficiency; TC: task completeness; repeated: the share of navigations "
        "to a type visited before; tokens: of the replies in an episode",
        "paper: arXiv 2503.21696, other tasks, in Unity's rooms",
        more=[_paper_row(name) for name in names if name in PAPER],
        may_turn=True,
    )
    with_faults = results_table(
        "What faults cost, in %",
        "rung success change loss_reduction repeat_rate",
        [each for each in results if each.differences["change"]],
        "change: in success by the faults, paired over tasks",
        "loss reduction: how much smaller the loss is than that of the rung before",
    )
    repeats = results_table(
        "Repeated exploration, in %",
        "rung repeat_rate more_repeats revisit_rate more_revisits",
        [each for each in results if each.differences["more_repeats"]],
        "repeated: the share of navigations to a type visited before; revisited: to an object "
        "visited before, so that another cabinet is new",
        "more: than after the first stage measured with as many faults, paired over tasks",
    )
    by_length = results_table("Success by the number of key actions, in %", "rung lengths", results)
    return [every, *(table for table in (with_faults, repeats) if table.rows), by_length]


def _paper_row(name: str) -> tuple[str, ...]:
    paper = PAPER[name]
    told = (paper.search_efficiency, paper.completeness, *paper.groups)
    return (
        *(f"paper: {paper.name}", "0", "809", f"{paper.success:.1f}"),
        *[NONE] * 3,
        *(f"{each:.1f}" for each in told),
        *[NONE] * 2,
    )
