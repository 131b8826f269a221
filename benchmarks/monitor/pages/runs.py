"""The list of runs, and a run: its progress, its figures and its episodes."""

from __future__ import annotations

from fastapi import Request, Response

from benchmarks.monitor.run_view import Filter
from benchmarks.monitor.site import Routes, Site


class RunPages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/": self.home, "/runs/{id}": self.run}

    def home(self, request: Request) -> Response:
        """All runs."""
        summaries = [self._site.summary(place) for place in self._site.places.of_kind("run")]
        summaries.sort(key=lambda each: (each.state != "playing", each.place.name))
        told = {"runs": summaries, "roots": self._site.places.roots, "live": "*"}
        return self._site.show(request, "home.html", told)

    def run(self, request: Request, id: str) -> Response:
        """A run."""
        place = self._site.place(id, "run")
        chosen = Filter.of(request.query_params)
        with self._site.runs.use(place) as view:
            groups, types = view.tallies()
            told = {
                "run": view.summary(),
                "filter": chosen,
                "page": view.page(chosen),
                "groups": groups,
                "types": types,
                "choices": view.choices(),
                "live": id,
            }
        return self._site.show(request, "run.html", told)
