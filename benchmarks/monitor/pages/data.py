"""Data: the list of collections, a collection, and a trajectory turn by turn."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fastapi import Request, Response

from benchmarks.monitor.collection_index import Collections
from benchmarks.monitor.data_view import (
    DataFilter,
    outcome_of,
    overview,
    record_of,
    turns_of,
)
from benchmarks.monitor.episode_view import file_inside
from benchmarks.monitor.fingerprint import changed, in_use, parts_of
from benchmarks.monitor.listing import neighbours, page_of
from benchmarks.monitor.pages.replays import ReplayPages
from benchmarks.monitor.places import Place
from benchmarks.monitor.run_view import RunSummary
from benchmarks.monitor.site import NothingThere, Routes, Site, or_nothing
from benchmarks.monitor.world import CannotReplay
from er_gym.data.collection import PARTS, Collection, CollectionManifest
from er_gym.data.line_index import trajectory_at
from er_gym.data.trajectory import Trajectory
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory


@dataclass(frozen=True)
class CollectionRow:
    """What the list says of a collection.

    Attributes:
        place: its directory.
        manifest: what is collected; None if that cannot be read.
        state: ``running``, ``finished`` or ``stopped``.
        trajectories: how many are taken; None before the file is written.
        changed: when it changed last, seconds since the epoch.
    """

    place: Place
    manifest: CollectionManifest | None
    state: str
    trajectories: int | None
    changed: float


class DataPages(ReplayPages):
    """See the file."""

    address = "/data/{id}"

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self._collections = Collections()

    def routes(self) -> Routes:
        """The pages by address."""
        return {
            "/data": self.all,
            "/data/{id}": self.collection,
            "/data/{id}/trajectory": self.trajectory,
            **super().routes(),
        }

    def all(self, request: Request) -> Response:
        """All collections."""
        rows = [self._row(place) for place in self._site.places.of_kind("collection")]
        rows.sort(key=lambda row: (row.state != "running", row.place.name))
        variables = {"rows": rows, "roots": self._site.places.roots, "live": "*", "at": "data"}
        return self._site.show(request, "data.html", variables)

    def collection(self, request: Request, id: str) -> Response:
        """A collection."""
        place = self._site.place(id, "collection")
        filter = DataFilter.of(request.query_params)
        with self._collections.use(place) as index:
            taken = filter.chosen(index.heads)
            variables = overview(index, self._site.translator(request))
            variables |= {"total": len(index.heads), "found": index.found, "damaged": index.damaged}
            variables["unknown"] = filter.unknown_type(index.found.task_types)
        variables |= {
            "row": self._row(place),
            "filter": filter,
            "page": page_of(taken, filter.page),
            "outcome_of": outcome_of,
            "playing": self._parts(place),
            "live": id,
            "at": "data",
        }
        return self._site.show(request, "collection.html", variables)

    def trajectory(self, request: Request, id: str, key: str = "") -> Response:
        """A trajectory, turn by turn."""
        place = self._site.place(id, "collection")
        filter = DataFilter.of(request.query_params)
        trajectory = self._trajectory(place, key)
        with self._collections.use(place) as index:
            ids = [head.id for head in filter.chosen(index.heads)]
        before, after = neighbours(ids, key)
        turns, pictures = turns_of(trajectory)
        variables = {
            "place": place,
            "key": key,
            "trajectory": trajectory,
            "turns": turns,
            "pictures": pictures,
            "filter": filter,
            "before": before,
            "after": after,
            "scripts": ("episode.js",),
            "at": "data",
        }
        return self._site.show(request, "trajectory.html", variables)

    def _picture(self, id: str, key: str, n: int) -> Path | None:
        place = self._site.place(id, "collection")
        _, pictures = turns_of(self._trajectory(place, key))
        return file_inside(place.path, PARTS, pictures[n].path) if 0 <= n < len(pictures) else None

    def _trajectory(self, place: Place, key: str) -> Trajectory:
        with self._collections.use(place) as index:
            head = index.at(key)
        if head is None:
            raise NothingThere
        with or_nothing():
            return trajectory_at(Collection.open(place.path), head.offset)

    def _played(self, id: str, key: str) -> tuple[Manifest, EpisodeRecord]:
        place = self._site.place(id, "collection")
        trajectory = self._trajectory(place, key)
        if trajectory.part not in parts_of(place.path):
            raise CannotReplay("its part is not there")
        try:
            run = RunDirectory.open(place.path / PARTS / trajectory.part)
        except (ValueError, OSError) as error:
            raise CannotReplay(str(error).splitlines()[0]) from None
        return run.manifest, record_of(trajectory)

    def _row(self, place: Place) -> CollectionRow:
        try:
            manifest = Collection.open(place.path).manifest
        except (ValueError, OSError):
            manifest = None
        count = self._collections.count(place)
        working = in_use(place.path) or any(
            in_use(place.path / PARTS / part) for part in parts_of(place.path)
        )
        state = "running" if working else "stopped" if count is None else "finished"
        return CollectionRow(place, manifest, state, count, changed(place))

    def _parts(self, place: Place) -> list[tuple[str, RunSummary]]:
        """The parts as runs: how far each has come."""
        found = []
        for part in parts_of(place.path):
            run = Place(f"{place.id}/{part}", "run", place.path / PARTS / part, part)
            found.append((part, self._site.summary(run)))
        return found
