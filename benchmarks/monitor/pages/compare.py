"""Runs side by side, and two episodes of the same task."""

from __future__ import annotations

from dataclasses import dataclass

from fastapi import Request, Response

from benchmarks.monitor.comparison import (
    CHANGES,
    MEASURES,
    Pair,
    by_type,
    difference,
    measures_of,
    pairs_of,
)
from benchmarks.monitor.directories import Directory
from benchmarks.monitor.episode_view import EpisodeView, view_of
from benchmarks.monitor.failures import FAILURES
from benchmarks.monitor.listing import page_number, page_of
from benchmarks.monitor.record_figures import SHOWN
from benchmarks.monitor.settings_view import settings_of
from benchmarks.monitor.site import NotFound, Routes, Site, or_nothing
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.run_directory import RunDirectory

MOST_RUNS = 12
"""No more runs are compared at once."""


@dataclass(frozen=True)
class Side:
    """One of two episodes.

    Attributes:
        directory: of its run.
        agent: who plays.
        episode: the episode.
        parts_at: the number of the first step that the other episode does not have there.
    """

    directory: Directory
    agent: str
    episode: EpisodeView
    parts_at: int


class ComparePages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/compare": self.compare, "/compare/episode": self.episodes}

    def compare(self, request: Request) -> Response:
        """Every run beside the first, and which tasks changed in one of them."""
        asked = list(dict.fromkeys(request.query_params.getlist("of")))[:MOST_RUNS]
        directories = [self._site.directory(id, "run") for id in asked]
        runs = [
            (self._site.summary(directory), self._site.rows(directory)) for directory in directories
        ]
        by = request.query_params.get("by", "")
        chosen = asked.index(by) if by in asked[1:] else 1
        change = request.query_params.get("change", "")
        change = change if change in CHANGES else ""
        counts = [self._site.failures(directory) for directory in directories]
        means = [self._site.means(directory) for directory in directories]
        measures = measures_of(rows for _, rows in runs)
        measure = request.query_params.get("measure", "")
        measure = measure if measure in measures else MEASURES[0]
        differences = [
            (summary, difference("", pairs_of(runs[0][1], rows, measure)))
            for summary, rows in runs[1:]
        ]
        pairs: list[Pair] = []
        if len(runs) > 1:
            pairs = pairs_of(runs[0][1], runs[chosen][1], measure)
        flipped = [
            pair
            for pair in pairs
            if (pair.change == change if change else pair.change in ("gained", "lost"))
        ]
        flipped.sort(key=lambda pair: (CHANGES.index(pair.change), pair.key))
        settings = settings_of([summary for summary, _ in runs])
        variables = {
            "runs": [summary for summary, _ in runs],
            "means": means,
            "metrics": [
                name
                for name in SHOWN
                if all(means) and any(each.metrics.get(name) for each in means if each)
            ],
            "measure": measure,
            "measures": measures,
            "scorer": CORRECTED.name,
            "failures": [
                (kind, [counted.numbers[kind] for counted in counts])
                for kind in FAILURES
                if any(counted.numbers[kind] for counted in counts)
            ],
            "settings": settings,
            "unlike": [one for one in settings if one.differs and one.matters],
            "counted": [(counted.done, counted.failed) for counted in counts],
            # Those that are compared, in their order: the form keeps the first one the first.
            "every": [
                self._site.summary(directory)
                for directory in dict.fromkeys(
                    (*directories, *self._site.directories.of_kind("run"))
                )
            ],
            "asked": asked,
            "first": runs[0][0] if runs else None,
            "second": runs[chosen][0] if len(runs) > 1 else None,
            "differences": differences,
            "types": by_type(pairs),
            "change": change,
            "changes": CHANGES,
            "page": page_of(flipped, page_number(request.query_params)),
            "live": ",".join(asked),
            "at": "runs",
        }
        return self._site.show(request, "compare.html", variables)

    def episodes(self, request: Request, key: str = "") -> Response:
        """Two episodes of a task, step by step."""
        asked = request.query_params.getlist("of")
        if len(asked) != 2:
            raise NotFound
        directories = [self._site.directory(id, "run") for id in asked]
        with or_nothing():
            runs = [RunDirectory.open(directory.path) for directory in directories]
            views = [view_of(run, key) for run in runs]
        parts_at = _parts_at(*views)
        variables = {
            "key": key,
            "asked": asked,
            "sides": [
                Side(directory, run.manifest.agent, view, parts_at)
                for directory, run, view in zip(directories, runs, views, strict=True)
            ],
            "parts_at": parts_at,
            "at": "runs",
            "scripts": ("episode.js", "enlarge.js"),
        }
        return self._site.show(request, "compare_episode.html", variables)


def _parts_at(one: EpisodeView, other: EpisodeView) -> int:
    """The number of the first step in which two episodes differ."""
    for first, second in zip(one.steps, other.steps, strict=False):
        if (first.action, first.record.success) != (second.action, second.record.success):
            return first.number
    return min(len(one.steps), len(other.steps))
