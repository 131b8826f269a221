"""What the pages say of a ladder or an ablation: its phases, and the success that it has measured.

The figures are those of its evaluations' pages: read from their event streams, so they grow live.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import yaml
from pydantic import BaseModel, ValidationError

from benchmarks.ablation.phases import evaluation_of
from benchmarks.ablation.phases import plan_of as plan_of_ablation
from benchmarks.ablation.settings import AblationSettings
from benchmarks.ladder.paper_rungs import PAPER
from benchmarks.ladder.phases import plan_of as plan_of_ladder
from benchmarks.ladder.phases import rungs
from benchmarks.ladder.settings import LadderSettings
from benchmarks.monitor.charts import Axis, Point, Series, chart
from benchmarks.monitor.growth import changed, in_use
from benchmarks.monitor.language import Translator
from benchmarks.monitor.places import Place
from benchmarks.monitor.run_view import RunSummary, Tally
from benchmarks.plan.run import Plan, PlanRecord
from er_gym.tasks.errors import TaskFileError, first_problem
from er_gym.tasks.reading import read_text

_MAKERS: Mapping[str, tuple[type[BaseModel], Callable[[Any, Path], Plan]]] = {
    "ladder": (LadderSettings, plan_of_ladder),
    "ablation": (AblationSettings, plan_of_ablation),
}


class Inside(Protocol):
    """What is in a plan's directory."""

    def place(self, out: str) -> Place | None:
        """What is in a directory, relative to the plan's."""

    def run(self, place: Place) -> tuple[RunSummary, Sequence[Tally]]:
        """A run, and its success by group of tasks."""


@dataclass(frozen=True)
class PhaseView:
    """A phase.

    Attributes:
        name: of the phase. command: as one would type it.
        state: ``finished``, ``running``, ``stopped`` or ``waiting``.
        seconds: how long it took; None until it is done.
        place: the directory that it writes; None if there is none (yet).
    """

    name: str
    command: str
    state: str
    seconds: float | None
    place: Place | None


@dataclass(frozen=True)
class Measured:
    """A model that was measured, or will be.

    Attributes:
        name: of the rung or the row.
        faults: the rate of faults.
        runs: its evaluations that have begun.
        success: over their episodes so far.
        groups: the same for each group of tasks.
    """

    name: str
    faults: float
    runs: Sequence[RunSummary]
    success: Tally
    groups: Mapping[str, Tally]


@dataclass(frozen=True)
class StudyView:
    """Rows of an ablation that are compared; ``chart`` shows their success."""

    title: str
    rows: Sequence[Measured]
    chart: Any


@dataclass(frozen=True)
class PlanView:
    """A ladder or an ablation at a moment.

    Attributes:
        place: its directory.
        state: ``running``, ``finished``, ``stopped`` or ``waiting``.
        phases: in order.
        settings: as YAML. description: in its own words.
        problem: why it cannot be shown in full.
        changed: when a phase ended last, seconds since the epoch.
    """

    place: Place
    state: str
    phases: Sequence[PhaseView]
    settings: str
    description: str
    problem: str
    changed: float

    @property
    def finished(self) -> int:
        """How many phases are done."""
        return sum(phase.state == "finished" for phase in self.phases)


def plan_view(place: Place, inside: Inside) -> tuple[PlanView, Any]:
    """A ladder or an ablation, and its settings; None if they cannot be read."""
    model, make = _MAKERS[place.kind]
    file = place.path / f"{place.kind}.json"
    settings, problem, record, phases = None, "", None, []
    try:
        record = PlanRecord.model_validate_json(read_text(file))
        settings = model.model_validate(record.settings)
        phases = [(each.name, str(each), each.out) for each in make(settings, place.path).phases]
    except ValidationError as error:
        problem = f"{file.name}: {first_problem(error)}"
    except (TaskFileError, ValueError, OSError) as error:
        problem = str(error).splitlines()[0]
    done = {each.name: each for each in record.done} if record else {}
    if not phases:  # another version's settings: what it has done can be shown all the same
        phases = [(name, " ".join(("er-gym", *each.command)), "") for name, each in done.items()]
    working = in_use(place.path) or in_use(place.path / "running")
    views, begun = [], False
    for name, command, out in phases:
        if name in done:
            state = "finished"
        elif not begun:
            there = bool(out) and (place.path / out).exists()
            state, begun = "running" if working else "stopped" if there else "waiting", True
        else:
            state = "waiting"
        seconds = done[name].seconds if name in done else None
        views.append(PhaseView(name, command, state, seconds, inside.place(out) if out else None))
    finished = bool(views) and all(each.state == "finished" for each in views)
    state = "running" if working else "finished" if finished else "stopped" if done else "waiting"
    told = record.settings if record else {}
    view = PlanView(
        place=place,
        state=state,
        phases=views,
        settings=yaml.safe_dump(told, allow_unicode=True, sort_keys=False) if told else "",
        description=str(told.get("description", "")),
        problem=problem,
        changed=changed(place),
    )
    return view, settings


def ladder_rows(settings: LadderSettings, inside: Inside) -> list[Measured]:
    """The rungs of a ladder."""
    return [_measured(rung.name, rung.faults, [rung.run], inside) for rung in rungs(settings)]


def studies(settings: AblationSettings, inside: Inside, t: Translator) -> list[StudyView]:
    """The studies of an ablation."""
    rows = {
        name: _measured(name, 0.0, [evaluation_of(name, s) for s in settings.seeds], inside)
        for name in settings.rows
    }
    found: list[StudyView] = []
    for name, study in settings.studies.items():
        own = [rows[each] for each in study.rows]
        places = study.numbers or range(len(own))
        x = (
            Axis(study.axis, log=True, at=study.numbers)
            if study.numbers
            else Axis("", names=[each.name for each in own])
        )
        seeds = [
            (place, 100 * run.success.rate)
            for place, row in zip(places, own, strict=True)
            for run in row.runs
            if run.success.rate is not None
        ]
        series = [
            Series(t("all_seeds"), _points(places, own), "line" if study.numbers else "points",
                   whiskers=True, named=True),
            Series(t("each_seed"), [Point(x, y, y, y) for x, y in seeds], "points"),
        ]  # fmt: skip
        several = len(settings.seeds) > 1
        picture = chart(
            f"study-{len(found)}", study.title, x, Axis("%", low=0.0), series[: 1 + several]
        )
        found.append(StudyView(study.title or name, own, picture))
    return found


def ladder_chart(rows: Sequence[Measured], t: Translator) -> Any:
    """Success after each stage, beside the paper's; empty before the first episode."""
    names = list(dict.fromkeys(row.name for row in rows))
    paper = [
        Point(float(place), PAPER[name].success, PAPER[name].success, PAPER[name].success)
        for place, name in enumerate(names)
        if name in PAPER
    ]
    lines = []
    for rate in dict.fromkeys(row.faults for row in rows):
        own = [row for row in rows if row.faults == rate]
        found = _points([names.index(row.name) for row in own], own)
        name = t("with_faults", rate=f"{100 * rate:g}") if rate else t("this_ladder")
        lines.append(Series(name, found, whiskers=True, named=True))
    if not any(line.points for line in lines):
        return ""
    lines.append(Series(t("paper_models"), paper, "bars", named=True))
    x, y = Axis("", names=names), Axis(t("success_percent"), 0.0, 100.0)
    return chart("ladder", t("success_by_stage"), x, y, lines)


def _points(places: Sequence[float], rows: Sequence[Measured]) -> list[Point]:
    return [
        Point(float(place), 100 * tally.rate, 100 * tally.low, 100 * tally.high)
        for place, tally in ((place, row.success) for place, row in zip(places, rows, strict=True))
        if tally.rate is not None and tally.low is not None and tally.high is not None
    ]


def _measured(name: str, faults: float, outs: Sequence[str], inside: Inside) -> Measured:
    places = [inside.place(out) for out in outs]
    told = [inside.run(place) for place in places if place is not None and place.kind == "run"]
    runs = [summary for summary, _ in told]
    by_group: dict[str, list[Tally]] = {}
    for _, groups in told:
        for tally in groups:
            by_group.setdefault(tally.name, []).append(tally)
    return Measured(
        name=name,
        faults=faults,
        runs=runs,
        success=_sum(name, [run.success for run in runs]),
        groups={group: _sum(group, tallies) for group, tallies in by_group.items()},
    )


def _sum(name: str, tallies: Sequence[Tally]) -> Tally:
    return Tally.over(name, [result for each in tallies for result in each.results])
