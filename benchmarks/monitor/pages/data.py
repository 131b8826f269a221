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
from benchmarks.monitor.directories import Directory
from benchmarks.monitor.episode_view import file_inside
from benchmarks.monitor.fingerprint import changed, in_use, parts_of
from benchmarks.monitor.listing import neighbours, page_of
from benchmarks.monitor.pages.replays import ReplayPages
from benchmarks.monitor.run_view import RunSummary
from benchmarks.monitor.site import NotFound, Routes, Site, or_nothing
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
        directory: where it is.
        manifest: what is collected; None if that cannot be read.
        state: ``running``, ``finished`` or ``stopped``.
        trajectories: how many are taken; None before the file is written.
        changed: when it changed last, seconds since the epoch.
    """

    directory: Directory
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
        rows = [self._row(directory) for directory in self._site.directories.of_kind("collection")]
        rows.sort(key=lambda row: (row.state != "running", row.directory.name))
        variables = {"rows": rows, "roots": self._site.directories.roots, "live": "*", "at": "data"}
        return self._site.show(request, "data.html", variables)

    def collection(self, request: Request, id: str) -> Response:
        """A collection."""
        directory = self._site.directory(id, "collection")
        filter = DataFilter.of(request.query_params)
        with self._collections.use(directory) as index:
            taken = filter.chosen(index.heads)
            variables = overview(index, self._site.translator(request))
            variables |= {"total": len(index.heads), "found": index.found, "damaged": index.damaged}
            variables["unknown"] = filter.unknown_type(index.found.task_types)
        variables |= {
            "row": self._row(directory),
            "filter": filter,
            "page": page_of(taken, filter.page),
            "outcome_of": outcome_of,
            "playing": self._parts(directory),
            "live": id,
            "at": "data",
        }
        return self._site.show(request, "collection.html", variables)

    def trajectory(self, request: Request, id: str, key: str = "") -> Response:
        """A trajectory, turn by turn."""
        directory = self._site.directory(id, "collection")
        filter = DataFilter.of(request.query_params)
        trajectory = self._trajectory(directory, key)
        with self._collections.use(directory) as index:
            ids = [head.id for head in filter.chosen(index.heads)]
        before, after = neighbours(ids, key)
        turns, pictures = turns_of(trajectory)
        variables = {
            "directory": directory,
            "key": key,
            "trajectory": trajectory,
            "turns": turns,
            "pictures": pictures,
            "filter": filter,
            "before": before,
            "after": after,
            "scripts": ("episode.js", "enlarge.js"),
            "at": "data",
        }
        return self._site.show(request, "trajectory.html", variables)

    def _picture(self, id: str, key: str, n: int) -> Path | None:
        directory = self._site.directory(id, "collection")
        _, pictures = turns_of(self._trajectory(directory, key))
        return (
            file_inside(directory.path, PARTS, pictures[n].path) if 0 <= n < len(pictures) else None
        )

    def _trajectory(self, directory: Directory, key: str) -> Trajectory:
        with self._collections.use(directory) as index:
            head = index.at(key)
        if head is None:
            raise NotFound
        with or_nothing():
            return trajectory_at(Collection.open(directory.path), head.offset)

    def _played(self, id: str, key: str) -> tuple[Manifest, EpisodeRecord]:
        directory = self._site.directory(id, "collection")
        trajectory = self._trajectory(directory, key)
        if trajectory.part not in parts_of(directory.path):
            raise CannotReplay("its part is not there")
        try:
            run = RunDirectory.open(directory.path / PARTS / trajectory.part)
        except (ValueError, OSError) as error:
            raise CannotReplay(str(error).splitlines()[0]) from None
        return run.manifest, record_of(trajectory)

    def _row(self, directory: Directory) -> CollectionRow:
        try:
            manifest = Collection.open(directory.path).manifest
        except (ValueError, OSError):
            manifest = None
        count = self._collections.count(directory)
        working = in_use(directory.path) or any(
            in_use(directory.path / PARTS / part) for part in parts_of(directory.path)
        )
        state = "running" if working else "stopped" if count is None else "finished"
        return CollectionRow(directory, manifest, state, count, changed(directory))

    def _parts(self, directory: Directory) -> list[tuple[str, RunSummary]]:
        """The parts as runs: how far each has come."""
        found = []
        for part in parts_of(directory.path):
            run = Directory(f"{directory.id}/{part}", "run", directory.path / PARTS / part, part)
            found.append((part, self._site.summary(run)))
        return found
