"""Curves of several training runs over one another, which a reader smooths and zooms."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

import yaml
from fastapi import Request, Response
from fastapi.responses import JSONResponse

from benchmarks.monitor.curve_tail import CurveTail
from benchmarks.monitor.directories import Directory
from benchmarks.monitor.followed import Followed
from benchmarks.monitor.formats import brief
from benchmarks.monitor.site import Routes, Site
from benchmarks.monitor.training_view import CURVED, Trained, over_of, trained

MOST_RUNS = 24
"""No more runs are laid over one another."""
_MOST_SERIES = 60


class CurvePages:
    """See the file.

    Args:
        site: what is shown.
        curves: the curves of the runs that were looked at last.
    """

    def __init__(self, site: Site, curves: Followed[CurveTail]) -> None:
        self._site, self._curves = site, curves

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/training/curves": self.page, "/training/curves.json": self.points}

    def page(self, request: Request) -> Response:
        """Charts with which a reader can play."""
        chosen = self._chosen(request)
        asked = [directory.id for directory in chosen]
        kinds = list(dict.fromkeys(over_of(directory) for directory in chosen))
        variables = {
            "every": self._every(),
            "runs": chosen,
            "asked": asked,
            "over": " / ".join(map(self._site.translator(request), kinds)),
            "points": "/training/curves.json?" + urlencode([("of", id) for id in asked]),
            "live": ",".join(asked),
            "at": "training",
            "scripts": ("uPlot.iife.min.js", "curves.js"),
        }
        return self._site.show(request, "curves.html", variables)

    def points(self, request: Request) -> Response:
        """The points of all figures of some runs."""
        return JSONResponse(
            {"runs": [self._told(directory) for directory in self._chosen(request)]}
        )

    def _told(self, directory: Directory) -> Mapping[str, Any]:
        with self._curves.use(directory) as tail:
            series = {}
            for name in [name for name in tail.series if name != tail.over][:_MOST_SERIES]:
                points = tail.points(name)
                series[brief(name)] = [point.x for point in points], [point.y for point in points]
        return {
            "id": directory.id,
            "name": brief(directory.name),
            "group": _without_seed(trained(directory)),
            "series": series,
        }

    def _chosen(self, request: Request) -> list[Directory]:
        found = map(self._site.directories.get, dict.fromkeys(request.query_params.getlist("of")))
        return [each for each in found if each is not None and each.kind in CURVED][:MOST_RUNS]

    def _every(self) -> list[Trained]:
        every = self._site.directories.all()
        return [trained(directory) for directory in every if directory.kind in CURVED]


def _without_seed(run: Trained) -> str:
    """What is the same for runs that differ in their seed alone."""
    settings = yaml.safe_load(run.settings) if run.settings else run.directory.id
    told = f"{run.directory.kind} {_plain(settings)}"
    return hashlib.sha256(told.encode(errors="surrogatepass")).hexdigest()[:16]


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(each) for name, each in value.items() if name not in ("seed", "out")}
    return value
