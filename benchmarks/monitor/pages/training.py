"""Training: the list of all that trains, and the page of a policy, a fine-tuning, or a plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import Request, Response

from benchmarks.monitor.directories import Directory
from benchmarks.monitor.pages.curves import CurvePages
from benchmarks.monitor.run_view import RunSummary
from benchmarks.monitor.site import NotFound, Routes, Site
from benchmarks.monitor.success_count import SuccessCount
from benchmarks.monitor.training_view import (
    Trained,
    curves,
    finetuning_charts,
    policy_charts,
    reinforcement_charts,
    trained,
)
from er_gym.tasks.types import GROUPS

_PLANS = ("ladder", "ablation")
_CHARTS = {
    "policy": policy_charts,
    "finetuning": finetuning_charts,
    "reinforcement": reinforcement_charts,
}


class TrainingPages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._curves = curves()

    def routes(self) -> Routes:
        """The pages by address."""
        laid_over = CurvePages(self._site, self._curves)
        return {"/training": self.all, **laid_over.routes(), "/training/{id}": self.one}

    def all(self, request: Request) -> Response:
        """All that trains."""
        rows: list[Any] = []
        for directory in self._site.directories.all():
            if directory.kind in _PLANS:
                rows.append(self._plan(directory)[0])
            elif directory.kind in _CHARTS:
                rows.append(trained(directory))
        rows.sort(key=lambda row: (row.state != "running", row.directory.name))
        variables = {
            "rows": rows,
            "roots": self._site.directories.roots,
            "live": "*",
            "at": "training",
        }
        return self._site.show(request, "training.html", variables)

    def one(self, request: Request, id: str) -> Response:
        """A policy, a fine-tuning, a reinforcement, a ladder or an ablation."""
        directory = self._site.directories.get(id)
        if directory is not None and directory.kind in _PLANS:
            return self._show_plan(request, directory)
        if directory is None or directory.kind not in _CHARTS:
            raise NotFound
        t = self._site.translator(request)
        with self._curves.use(directory) as tail:
            run: Trained = trained(directory, tail.last if tail.lines else None)
            charts = _CHARTS[directory.kind](tail, t)
        variables = {"run": run, "charts": charts, "live": id, "at": "training"}
        return self._site.show(request, "trained.html", variables)

    def _show_plan(self, request: Request, directory: Directory) -> Response:
        from benchmarks.monitor.plan_view import part_views

        t = self._site.translator(request)
        inside = _Inside(self._site, directory)
        plan, settings = self._plan(directory)
        variables = {
            "compared": part_views(directory.kind, settings, inside, t) if settings else [],
            "plan": plan,
            "groups": GROUPS,
            "live": ",".join(
                [directory.id, *(each.id for each in inside.directories.values())][:100]
            ),
            "at": "training",
        }
        return self._site.show(request, "plan.html", variables)

    def _plan(self, directory: Directory) -> tuple[Any, Any]:
        # Imported when it is asked for: it knows how models are trained.
        from benchmarks.monitor.plan_view import plan_view

        return plan_view(directory, _Inside(self._site, directory))


class _Inside:
    """What is in a plan's directory."""

    def __init__(self, site: Site, plan: Directory) -> None:
        self._site, self._path = site, plan.path
        every = site.directories.all()
        self.directories = {each.path: each for each in every if plan.path in each.path.parents}

    def directory(self, out: str) -> Directory | None:
        return self.directories.get(self._path / out)

    def run(self, directory: Directory) -> tuple[RunSummary, Sequence[SuccessCount]]:
        with self._site.runs.use(directory) as view:
            return view.summary(), view.success_counts()[0]
