"""The charts of studies: success after the stages of a ladder, and of the rows of an ablation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from benchmarks.scoring.metrics import Estimate
from benchmarks.scoring.series import Axis, Chart, Series, percentages, points
from benchmarks.study.ablation_settings import Compared
from benchmarks.study.ladder_settings import CONTROLS
from benchmarks.study.paper_rungs import PAPER

Say: TypeAlias = Callable[..., str]
"""The words for a key, with values in their places."""
_WORDS: Mapping[str, str] = {
    "this_ladder": "this ladder",
    "with_faults": "this ladder, {rate} % of actions fail",
    "played_beside": "played beside it",
    "paper_models": "the paper's models, 809 tasks",
    "success_percent": "success, %",
    "all_seeds": "all seeds",
    "each_seed": "each seed",
}


def in_english(key: str, **values: object) -> str:
    """The words of pictures."""
    return _WORDS[key].format(**values)


@dataclass(frozen=True)
class Shown:
    """A model in a chart.

    Attributes:
        name: of the rung or the row.
        faults: the rate of faults.
        success: with its interval; None before the first episode.
        seeds: success with each seed.
    """

    name: str
    faults: float
    success: Estimate | None
    seeds: Sequence[float]


def ladder_chart(title: str, rungs: Sequence[Shown], say: Say = in_english) -> Chart:
    """Success over the rungs: bars for the paper's, a line with 95 % intervals for ours, and one
    for each rate of faults. Controls are points."""
    names = list(dict.fromkeys(each.name for each in rungs))

    def line(name: str, chosen: Sequence[Shown], joined: bool = True) -> Series:
        found = percentages([(names.index(each.name), each.success) for each in chosen])
        return Series(name, found, "line" if joined else "points", whiskers=True, named=True)

    climbed = [each for each in rungs if each.name not in CONTROLS]
    series = [
        line(
            say("with_faults", rate=f"{100 * rate:g}") if rate else say("this_ladder"),
            [each for each in climbed if each.faults == rate],
        )
        for rate in dict.fromkeys(each.faults for each in climbed)
    ]
    if len(climbed) < len(rungs):
        controls = [each for each in rungs if each.name in CONTROLS]
        series.append(line(say("played_beside"), controls, joined=False))
    if any(each.points for each in series):
        paper = [(names.index(name), one.success) for name, one in PAPER.items() if name in names]
        series.append(Series(say("paper_models"), points(paper), "bars", named=True))
    return Chart(title, Axis(names=names), Axis(say("success_percent"), 0.0, 100.0), series)


def comparison_chart(study: Compared, rows: Sequence[Shown], say: Say = in_english) -> Chart:
    """Success of rows, over their numbers where they have some: 95 % intervals, and where there are
    several seeds, a dot for each."""
    number_of = dict(zip(study.rows, study.numbers or range(len(study.rows)), strict=True))
    places = [(number_of[each.name], each) for each in rows]
    series = [
        Series(
            say("all_seeds"),
            percentages([(x, each.success) for x, each in places]),
            "line" if study.numbers else "points",
            whiskers=True,
            named=True,
        )
    ]
    if any(len(each.seeds) > 1 for each in rows):
        dots = [(float(x), 100 * rate) for x, each in places for rate in each.seeds]
        series.append(Series(say("each_seed"), points(dots), "points"))
    x = Axis(study.axis, log=True, at=study.numbers) if study.numbers else Axis(names=study.rows)
    return Chart(study.title, x, Axis(say("success_percent"), low=0.0), series)
