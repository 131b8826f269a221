"""The list of runs, and a run: its progress, its figures and its episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import Request, Response

from benchmarks.monitor.episode_filter import Filter
from benchmarks.monitor.language import Translator
from benchmarks.monitor.listing import page_of
from benchmarks.monitor.run_list import RunFilter, choices
from benchmarks.monitor.run_view import RunView
from benchmarks.monitor.server_view import server_view
from benchmarks.monitor.settings_view import settings_of
from benchmarks.monitor.site import READ_SECONDS, Routes, Site
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.study.paper_rungs import PAPER
from er_gym.tasks.types import COMPOSITE, MANIPULATE, SEARCH, TRANSPORT

_FILTER_SECONDS = 1.0
"""How long a page that is filtered by what records tell waits for them to be read."""
_PAPER_GROUPS = (SEARCH, MANIPULATE, TRANSPORT, COMPOSITE)
"""The groups, in the order of the paper's table."""


def _paper_rows() -> list[tuple[str, Mapping[str, float], float]]:
    """The paper's models: name, success by group, and over all, in %."""
    return [
        (rung.name, dict(zip(_PAPER_GROUPS, rung.groups, strict=True)), rung.success)
        for rung in PAPER.values()
    ]


def run_variables(view: RunView, chosen: Filter, t: Translator) -> dict[str, Any]:
    """What the page of a run says."""
    groups, types = view.success_counts()
    values = view.choices()
    summary, (means, means_by_group) = view.summary(), view.means()
    return {
        "run": summary,
        "settings": settings_of([summary]),
        "filter": chosen,
        "page": page_of(view.chosen(chosen), chosen.page),
        "groups": groups,
        "types": types,
        "samples": view.sample_counts(),
        "choices": values,
        "unknown": chosen.unknown_type(values["type"]),
        "failures": view.failures,
        "means": means,
        "means_by_group": means_by_group,
        "read": (view.figures.done, sum(row.ended is not None for row in view.rows.values())),
        "scorer": CORRECTED.name,
        "server": server_view(view.spending, view.server, t),
        "notes_problem": view.noted.problem,
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
        every = [
            self._site.summary(directory) for directory in self._site.directories.of_kind("run")
        ]
        chosen = RunFilter.of(request.query_params)
        variables = {
            "every": len(every),
            "page": page_of(chosen.chosen(every), chosen.page),
            "filter": chosen,
            "choices": choices(every),
            "roots": self._site.directories.roots,
            "live": "*",
            "at": "runs",
        }
        return self._site.show(request, "home.html", variables)

    def run(self, request: Request, id: str) -> Response:
        """A run."""
        directory = self._site.directory(id, "run")
        chosen = Filter.of(request.query_params)
        with self._site.runs.use(directory) as view:
            view.read_records(_FILTER_SECONDS if chosen.failure else READ_SECONDS)
            variables = run_variables(view, chosen, self._site.translator(request))
        return self._site.show(
            request, "run.html", {**variables, "live": id, "at": "runs", "scripts": ("notes.js",)}
        )
