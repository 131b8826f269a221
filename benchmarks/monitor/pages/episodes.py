"""An episode: its steps, pictures and key actions, and the room from above."""

from __future__ import annotations

import contextlib
import threading
from pathlib import Path
from urllib.parse import urlencode

from fastapi import Request, Response

from benchmarks.monitor.directories import Directory
from benchmarks.monitor.episode_filter import Filter
from benchmarks.monitor.episode_view import picture_file, view_of, view_so_far
from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.listing import neighbours
from benchmarks.monitor.pages.replays import ReplayPages
from benchmarks.monitor.site import NotFound, Routes, Site, or_nothing
from benchmarks.monitor.under_way import record_so_far
from benchmarks.monitor.video import as_webp, film
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.writing import file_stem


class EpisodePages(ReplayPages):
    """See the file."""

    address = "/runs/{id}"

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self._filming = threading.Lock()

    def routes(self) -> Routes:
        """The pages by address."""
        return {
            "/runs/{id}/episode": self.episode,
            "/runs/{id}/request": self.request,
            "/runs/{id}/video": self.video,
            **super().routes(),
        }

    def episode(self, request: Request, id: str, key: str = "") -> Response:
        """An episode."""
        directory = self._site.directory(id, "run")
        chosen = Filter.of(request.query_params)
        row = self._site.rows(directory).get(key)
        try:
            episode = view_of(RunDirectory.open(directory.path), key)
        except (ValueError, OSError) as error:
            if row is None:
                raise NotFound from None
            return self._unreadable(request, directory, row, chosen, str(error))
        with self._site.runs.use(directory) as view:
            before, after = neighbours([row.key for row in view.chosen(chosen)], key)
            summary = view.summary()
        variables = {
            "run": summary,
            "key": key,
            "episode": episode,
            "filter": chosen,
            "before": before,
            "after": after,
            "note": row.note if row else None,
            "at": "runs",
            "scripts": ("episode.js", "enlarge.js", "notes.js"),
        }
        return self._site.show(request, "episode.html", variables)

    def request(self, request: Request, id: str, key: str = "", n: int = 1) -> Response:
        """What a model was sent for a step: every message as it was sent."""
        directory = self._site.directory(id, "run")
        with or_nothing():
            episode = view_of(RunDirectory.open(directory.path), key)
            messages = episode.request(n)
        address = f"/runs/{id}/picture?"
        parts = [part for each in messages for part in each.parts]
        variables = {
            "run": self._site.summary(directory),
            "key": key,
            "number": n,
            "last": len(episode.steps),
            "step": episode.steps[n],
            "messages": messages,
            "pictures": sum(not isinstance(part, str) for part in parts),
            "addresses": {
                each.path: address + urlencode({"key": key, "n": number})
                for number, each in enumerate(episode.pictures)
            },
            "at": "runs",
            "scripts": ("enlarge.js",),
        }
        return self._site.show(request, "request.html", variables)

    def _unreadable(
        self, request: Request, directory: Directory, row: EpisodeRow, chosen: Filter, why: str
    ) -> Response:
        """An episode without a record: it is under way, or its record is damaged."""
        episode = None
        if row.ended is None:
            with contextlib.suppress(ValueError, OSError):
                run = RunDirectory.open(directory.path)
                episode = view_so_far(record_so_far(run.path, run.manifest, row))
        variables = {
            "episode": episode,
            "scripts": ("episode.js", "enlarge.js"),
            "directory": directory,
            "row": row,
            "filter": chosen,
            "why": "" if row.ended is None else why,
            "live": directory.id,
            "at": "runs",
        }
        return self._site.show(request, "episode_under_way.html", variables)

    def _played(self, id: str, key: str) -> tuple[Manifest, EpisodeRecord]:
        try:
            record, manifest = self._site.record(id, key)
        except NotFound:
            directory = self._site.directory(id, "run")
            row = self._site.rows(directory).get(key)
            if row is None or row.ended is not None:
                raise
            with or_nothing():
                manifest = RunDirectory.open(directory.path).manifest
            record = record_so_far(directory.path, manifest, row)
        return manifest, record

    def _picture(self, id: str, key: str, n: int) -> Path | None:
        directory = self._site.directory(id, "run")
        with or_nothing():
            pictures = view_of(RunDirectory.open(directory.path), key).pictures
        return picture_file(directory.path, pictures[n]) if 0 <= n < len(pictures) else None

    def video(self, id: str, key: str = "") -> Response:
        """An episode as an animated WebP, to keep."""
        with or_nothing(), self._filming:  # one at a time: it is the costliest page
            run = RunDirectory.open(self._site.directory(id, "run").path)
            data = as_webp(film(run, key, self._worlds))
        named = f'attachment; filename="{file_stem(key)}.webp"'
        return Response(data, media_type="image/webp", headers={"Content-Disposition": named})
