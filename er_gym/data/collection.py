"""A collection: a directory of trajectories and their pictures.

::

    data/x/collection.json                     what is collected
    data/x/trajectories.jsonl                  the trajectories, one a line
    data/x/parts/PART/                         a run directory for each part, with
    data/x/parts/PART/trajectories/ID.json     every trajectory as it was played, and
    data/x/parts/PART/pictures/ID/000.jpeg     its pictures

Parts are ordinary run directories (:mod:`er_gym.rollout.run_directory`), so that collecting can be
interrupted and continued like any run. ``trajectories.jsonl`` holds those trajectories that are
taken, in the order of the parts, and is replaced as a whole.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from er_gym.data.trajectory import Trajectory
from er_gym.locking import LOCK
from er_gym.resumable import FolderConflict, FolderKind, ResumableFolder, has_content
from er_gym.rollout.run_directory import RUN, RunDirectory, RunDirectoryError
from er_gym.tasks.errors import TaskFileError, first_problem
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem, inside, replaced

MANIFEST = "collection.json"
TRAJECTORIES = "trajectories.jsonl"
PARTS = "parts"
PLAYED = "trajectories"
"""The folder of a part that holds every trajectory as it was played."""


class CollectionError(FolderConflict):
    """The directory cannot be used as a collection; the message says why and what to do."""


class CollectionManifest(BaseModel):
    """What is collected. Two commands with equal manifests may share a directory.

    Attributes:
        format: the version of this layout.
        suite: the suite's name, and ``suite_digest`` of its tasks' content.
        settings: all that decides what the trajectories are: recipe, writer, language, faults ...
        seed: the seed from which everything is drawn.
        er_gym: the version of the package.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/collection/1"] = "er-gym/collection/1"
    suite: str
    suite_digest: str
    settings: dict[str, Any] = {}
    seed: int
    er_gym: str


def _holds_something(path: Path) -> bool:
    """Whether there is more than a command leaves that is stopped before its first episode."""
    held = {each.name for each in path.iterdir()} - {MANIFEST, TRAJECTORIES, PARTS, LOCK}
    parts = (path / PARTS).glob("*")
    return bool(held) or has_content(path / TRAJECTORIES) or any(map(RUN.holds_something, parts))


COLLECTION = FolderKind(
    noun="collection",
    command="er-gym collect",
    manifest=MANIFEST,
    model=CollectionManifest,
    parts=(TRAJECTORIES, PARTS),
    holds_something=_holds_something,
    error=CollectionError,
)


class Collection(ResumableFolder[CollectionManifest]):
    """A collection."""

    KIND = COLLECTION

    def part_path(self, part: str) -> Path:
        """The run directory of a part."""
        return self.path / PARTS / part

    def parts(self) -> dict[str, RunDirectory]:
        """The parts that have begun, by name, in alphabetical order.

        Raises:
            CollectionError: the manifest of a part is damaged.
        """
        try:
            return {
                path.name: RunDirectory.open(path)
                for path in sorted((self.path / PARTS).glob("*"))
                if path.is_dir()
            }
        except RunDirectoryError as error:
            raise CollectionError(str(error)) from error

    def played(self, part: str, trajectory_id: str) -> Trajectory:
        """A trajectory of a part as it was played, taken or not.

        Raises:
            CollectionError: it is not there, or it is damaged.
        """
        file = inside(self.path / PARTS, part) / PLAYED / f"{file_stem(trajectory_id)}.json"
        try:
            return Trajectory.model_validate_json(read_bytes(file))
        except (TaskFileError, ValidationError) as error:
            raise CollectionError(f"{file}: {first_problem(error, 'the line')}") from error

    def has_pictures(self, trajectory: Trajectory) -> bool:
        """Whether all pictures of a trajectory are there."""
        pictures = (picture for turn in trajectory.turns for picture in turn.pictures)
        return all(inside(self.path, picture.path).is_file() for picture in pictures)

    def write(self, trajectories: Iterable[Trajectory]) -> int:
        """Replace ``trajectories.jsonl`` as a whole, and return how many lines it has.

        Memory does not grow with their number.

        Raises:
            CannotWrite: the disk is full, for example; the old file is unchanged.
        """
        count = 0
        with replaced(self.path / TRAJECTORIES) as file:
            for trajectory in trajectories:
                file.write(trajectory.model_dump_json() + "\n")
                count += 1
        return count

    def trajectories(self) -> Iterator[Trajectory]:
        """The trajectories that are taken, in order, one at a time.

        Raises:
            CollectionError: the file is not there, or a line is damaged or there twice; the message
                names it.
        """
        path = self.path / TRAJECTORIES
        ids: set[int] = set()
        with self.open_lines() as file:
            for number, line in enumerate(file, 1):
                try:
                    trajectory = Trajectory.model_validate_json(line)
                except ValidationError as error:
                    raise damaged_line(f"{path}:{number}", error) from error
                if hash(trajectory.id) in ids:
                    raise CollectionError(
                        f"{path}:{number}: the trajectory {trajectory.id!r:.300} is there twice; "
                        f"{_ANEW}"
                    )
                ids.add(hash(trajectory.id))
                yield trajectory

    def open_lines(self) -> BinaryIO:
        """``trajectories.jsonl``, opened to be read.

        Raises:
            CollectionError: it is not there, or no file.
        """
        path = self.path / TRAJECTORIES
        try:
            if path.exists() and not path.is_file():  # reading a pipe would block
                raise OSError(0, "not a regular file")
            return path.open("rb")
        except OSError as error:
            raise CollectionError(
                f"{path} cannot be read ({error.strerror}); er-gym collect writes it when it ends "
                "or is interrupted: run the same command again"
            ) from error


_ANEW = "the er-gym collect that made the collection writes the file anew"


def damaged_line(place: str, error: ValidationError) -> CollectionError:
    """What to say of a line that is no trajectory."""
    return CollectionError(f"{place}: {first_problem(error, 'the line')}; {_ANEW}")
