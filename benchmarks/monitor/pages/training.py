"""Training: the list of all that trains, and the page of a policy, a fine-tuning, or a plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fastapi import Request, Response

from benchmarks.monitor.places import Place
from benchmarks.monitor.run_view import RunSummary, SuccessCount
from benchmarks.monitor.site import NothingThere, Routes, Site
from benchmarks.monitor.training_view import (
    Trained,
    curves,
    finetuning_charts,
    policy_charts,
    trained,
)
from er_gym.tasks.types import GROUPS

_PLANS = ("ladder", "ablation")
_CHARTS = {"policy": policy_charts, "finetuning": finetuning_charts}


class TrainingPages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._curves = curves()

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/training": self.all, "/training/{id}": self.one}

    def all(self, request: Request) -> Response:
        """All that trains."""
        rows: list[Any] = []
        for place in self._site.places.all():
            if place.kind in _PLANS:
                rows.append(self._plan(place)[0])
            elif place.kind in _CHARTS:
                rows.append(trained(place))
        rows.sort(key=lambda row: (row.state != "running", row.place.name))
        variables = {"rows": rows, "roots": self._site.places.roots, "live": "*", "at": "training"}
        return self._site.show(request, "training.html", variables)

    def one(self, request: Request, id: str) -> Response:
        """A policy, a fine-tuning, a ladder or an ablation."""
        place = self._site.places.get(id)
        if place is not None and place.kind in _PLANS:
            return self._show_plan(request, place)
        if place is None or place.kind not in _CHARTS:
            raise NothingThere
        t = self._site.translator(request)
        with self._curves.use(place) as tail:
            run: Trained = trained(place, tail.last if tail.lines else None)
            charts = _CHARTS[place.kind](tail, t)
        variables = {"run": run, "charts": charts, "live": id, "at": "training"}
        return self._site.show(request, "trained.html", variables)

    def _show_plan(self, request: Request, place: Place) -> Response:
        from benchmarks.monitor.plan_view import part_views

        t = self._site.translator(request)
        inside = _Inside(self._site, place)
        plan, settings = self._plan(place)
        variables = {
            "compared": part_views(place.kind, settings, inside, t) if settings else [],
            "plan": plan,
            "groups": GROUPS,
            "live": ",".join([place.id, *(each.id for each in inside.places.values())][:100]),
            "at": "training",
        }
        return self._site.show(request, "plan.html", variables)

    def _plan(self, place: Place) -> tuple[Any, Any]:
        # Imported when it is asked for: it knows how models are trained.
        from benchmarks.monitor.plan_view import plan_view

        return plan_view(place, _Inside(self._site, place))


class _Inside:
    """What is in a plan's directory."""

    def __init__(self, site: Site, plan: Place) -> None:
        self._site, self._path = site, plan.path
        every = site.places.all()
        self.places = {each.path: each for each in every if plan.path in each.path.parents}

    def place(self, out: str) -> Place | None:
        return self.places.get(self._path / out)

    def run(self, place: Place) -> tuple[RunSummary, Sequence[SuccessCount]]:
        with self._site.runs.use(place) as view:
            return view.summary(), view.success_counts()[0]
