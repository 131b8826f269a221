"""What the pages say of a ladder or an ablation: its phases, and the success that it has measured.

The figures are those of its evaluations' pages: read from their event streams, so they grow live.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import yaml
from pydantic import ValidationError

from benchmarks.monitor.charts import as_svg
from benchmarks.monitor.directories import Directory
from benchmarks.monitor.fingerprint import changed, in_use
from benchmarks.monitor.language import Translator
from benchmarks.monitor.run_view import RunSummary
from benchmarks.monitor.success_count import SuccessCount
from benchmarks.scoring.metrics import Estimate
from benchmarks.study.charts import Shown
from benchmarks.study.kinds import KINDS, Study
from benchmarks.study.phase import Measurement
from benchmarks.study.run import PlanRecord
from er_gym.tasks.errors import TaskFileError, first_problem
from er_gym.tasks.reading import read_text


class Inside(Protocol):
    """What is in a plan's directory."""

    def directory(self, out: str) -> Directory | None:
        """What is in a directory, relative to the plan's."""

    def run(self, directory: Directory) -> tuple[RunSummary, Sequence[SuccessCount]]:
        """A run, and its success by group of tasks."""


@dataclass(frozen=True)
class PhaseView:
    """A phase.

    Attributes:
        name: of the phase. command: as one would type it.
        state: ``finished``, ``running``, ``stopped`` or ``waiting``.
        seconds: how long it took; None until it is done.
        directory: what it writes; None if there is none (yet).
    """

    name: str
    command: str
    state: str
    seconds: float | None
    directory: Directory | None


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
    success: SuccessCount
    groups: Mapping[str, SuccessCount]

    @property
    def shown(self) -> Shown:
        """As a chart shows it."""
        rate = self.success.rate
        success = None if rate is None else Estimate(rate, self.success.low, self.success.high)
        rates = [run.success.rate for run in self.runs if run.success.rate is not None]
        return Shown(self.name, self.faults, success, rates)


@dataclass(frozen=True)
class PartView:
    """Models that are compared; ``chart`` shows their success."""

    title: str
    rows: Sequence[Measured]
    chart: Any


@dataclass(frozen=True)
class PlanView:
    """A ladder or an ablation at a moment.

    Attributes:
        directory: where it is.
        state: ``running``, ``finished``, ``stopped`` or ``waiting``.
        phases: in order.
        settings: as YAML. description: in its own words.
        problem: why it cannot be shown in full.
        changed: when a phase ended last, seconds since the epoch.
    """

    directory: Directory
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


def plan_view(directory: Directory, inside: Inside) -> tuple[PlanView, Any]:
    """A ladder or an ablation, and its settings; None if they cannot be read."""
    kind = KINDS[directory.kind]
    file = directory.path / f"{directory.kind}.json"
    settings, problem, record, phases = None, "", None, []
    try:
        record = PlanRecord.model_validate_json(read_text(file))
        settings = kind.settings.model_validate(record.settings)
        phases = [
            (each.name, str(each), each.out)
            for each in Study(kind, directory.path, settings).plan.phases
        ]
    except ValidationError as error:
        problem = f"{file.name}: {first_problem(error)}"
    except (TaskFileError, ValueError, OSError) as error:
        problem = str(error).splitlines()[0]
    done = {each.name: each for each in record.done} if record else {}
    if not phases:  # another version's settings: what it has done can be shown all the same
        phases = [(name, " ".join(("er-gym", *each.command)), "") for name, each in done.items()]
    working = in_use(directory.path) or in_use(directory.path / "running")
    views, begun = [], False
    for name, command, out in phases:
        if name in done:
            state = "finished"
        elif not begun:
            there = bool(out) and (directory.path / out).exists()
            state, begun = "running" if working else "stopped" if there else "waiting", True
        else:
            state = "waiting"
        seconds = done[name].seconds if name in done else None
        views.append(
            PhaseView(name, command, state, seconds, inside.directory(out) if out else None)
        )
    finished = bool(views) and all(each.state == "finished" for each in views)
    state = "running" if working else "finished" if finished else "stopped" if done else "waiting"
    told = record.settings if record else {}
    view = PlanView(
        directory=directory,
        state=state,
        phases=views,
        settings=yaml.safe_dump(told, allow_unicode=True, sort_keys=False) if told else "",
        description=str(told.get("description", "")),
        problem=problem,
        changed=changed(directory),
    )
    return view, settings


def part_views(kind: str, settings: Any, inside: Inside, t: Translator) -> list[PartView]:
    """The models of a ladder or an ablation that are compared."""
    found: list[PartView] = []
    for part in KINDS[kind].parts(settings):
        rows = [_measured(each, inside) for each in part.measured]
        chart = part.chart([row.shown for row in rows], t)
        if kind == "ladder":
            chart = replace(chart, title=t("success_by_stage"))
        picture = as_svg(f"part-{len(found)}", chart)
        found.append(PartView(chart.title or part.name, rows, picture))
    return found


def _measured(of: Measurement, inside: Inside) -> Measured:
    directories = [inside.directory(out) for out in of.runs.values()]
    told = [
        inside.run(directory)
        for directory in directories
        if directory is not None and directory.kind == "run"
    ]
    runs = [summary for summary, _ in told]
    by_group: dict[str, list[SuccessCount]] = {}
    for _, groups in told:
        for count in groups:
            by_group.setdefault(count.name, []).append(count)
    return Measured(
        name=of.name,
        faults=of.faults,
        runs=runs,
        success=_sum(of.name, [run.success for run in runs]),
        groups={group: _sum(group, counts) for group, counts in by_group.items()},
    )


def _sum(name: str, counts: Sequence[SuccessCount]) -> SuccessCount:
    return SuccessCount.over(name, [result for each in counts for result in each.results])
