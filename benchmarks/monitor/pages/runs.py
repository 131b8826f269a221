"""The list of runs, and a run: its progress, its figures and its episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import Request, Response

from benchmarks.monitor.listing import page_of
from benchmarks.monitor.run_view import Filter, RunView
from benchmarks.monitor.settings_view import settings_of
from benchmarks.monitor.site import Routes, Site
from benchmarks.study.paper_rungs import PAPER
from er_gym.tasks.types import COMPOSITE, MANIPULATE, SEARCH, TRANSPORT

_COUNT_SECONDS = 0.1
"""How long a page may wait for failures to be counted; the rest follows while it is open."""
_PAPER_GROUPS = (SEARCH, MANIPULATE, TRANSPORT, COMPOSITE)
"""The groups, in the order of the paper's table."""


def _paper_rows() -> list[tuple[str, Mapping[str, float], float]]:
    """The paper's models: name, success by group, and over all, in %."""
    return [
        (rung.name, dict(zip(_PAPER_GROUPS, rung.groups, strict=True)), rung.success)
        for rung in PAPER.values()
    ]


def run_variables(view: RunView, chosen: Filter) -> dict[str, Any]:
    """What the page of a run says."""
    groups, types = view.success_counts()
    choices = view.choices()
    summary = view.summary()
    return {
        "run": summary,
        "settings": settings_of([summary]),
        "filter": chosen,
        "page": page_of(view.chosen(chosen), chosen.page),
        "groups": groups,
        "types": types,
        "samples": view.sample_counts(),
        "choices": choices,
        "unknown": chosen.unknown_type(choices["type"]),
        "failures": view.failures,
        "paper": _paper_rows(),
    }


class RunPages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/": self.home, "/runs/{id}": self.run}

    def home(self, request: Request) -> Response:
        """All runs."""
        summaries = [
            self._site.summary(directory) for directory in self._site.directories.of_kind("run")
        ]
        summaries.sort(key=lambda each: (each.state != "playing", each.directory.name))
        variables = {"runs": summaries, "roots": self._site.directories.roots, "live": "*"}
        return self._site.show(request, "home.html", variables)

    def run(self, request: Request, id: str) -> Response:
        """A run."""
        directory = self._site.directory(id, "run")
        chosen = Filter.of(request.query_params)
        with self._site.runs.use(directory) as view:
            view.count_failures(_COUNT_SECONDS)
            variables = run_variables(view, chosen)
        return self._site.show(request, "run.html", {**variables, "live": id})
