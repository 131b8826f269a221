"""Frames: pictures of rooms with the objects in view, to pretrain a model's vision.

::

    DIR/frames.json                 what is drawn
    DIR/frames.jsonl                the frames, one a line
    DIR/visits/00012.json           the frames of one visit to a room, written when it is whole
    DIR/pictures/00012/03.jpeg      their pictures; 03-right.jpeg and so on after looking around

:mod:`er_gym.data.frame_camera` draws them. A dialect puts them into words
(:mod:`er_gym.data.frame_chat`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from er_gym.data.trajectory import PictureRecord, SeenObject
from er_gym.resumable import FolderConflict, FolderKind, ResumableFolder, has_content
from er_gym.tasks.errors import first_problem
from er_gym.tasks.reading import read_bytes
from er_gym.writing import make_folder, write_atomic

MANIFEST = "frames.json"
FRAMES = "frames.jsonl"
VISITS, PICTURES = "visits", "pictures"


class FramesError(FolderConflict):
    """The directory cannot be used for frames; the message says why and what to do."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Frame(_Record):
    """What is seen from a pose.

    Attributes:
        id: unique in its directory.
        scene, layout: the room, and the name of its arrangement.
        x, z, rotation, horizon: the agent's pose, metres and degrees.
        pictures: the view ahead; after looking around also those to the right, behind and left.
        view: the objects in view ahead, nearest first.
        views: after looking around, the objects in view in each direction.
        navigable: the types that one can navigate to from what is seen here, ``views`` included.
        interactable: the types within reach.
        absent: the types of things in the room that are not in view ahead.
        covers, cells: what covers the squares of the view ahead
            (:class:`er_gym.data.cells.CoveredPicture`); empty if that is not known.
    """

    id: str
    scene: str
    layout: str = ""
    x: float
    z: float
    rotation: float
    horizon: float
    pictures: list[PictureRecord]
    view: list[SeenObject]
    views: dict[str, list[SeenObject]] = {}
    navigable: list[str] = []
    interactable: list[str] = []
    absent: list[str] = []
    covers: tuple[str, ...] = ()
    cells: str = ""


class FramesManifest(_Record):
    """What is drawn. Two commands with equal manifests may share a directory.

    Attributes:
        format: the version of this layout.
        suite: the suite's name, and ``suite_digest`` of its tasks' content.
        settings: ``env``, the environment's arguments, ``pictures``, their file format, and
            ``scenes``, the rooms.
        seed: the seed from which everything is drawn.
        er_gym: the version of the package.
    """

    format: Literal["er-gym/frames/1"] = "er-gym/frames/1"
    suite: str
    suite_digest: str
    settings: dict[str, Any]
    seed: int
    er_gym: str


_VISIT = TypeAdapter(list[Frame])


FRAME_SET = FolderKind(
    noun="folder of frames",
    command="er-gym data frames",
    manifest=MANIFEST,
    model=FramesManifest,
    parts=(FRAMES, VISITS, PICTURES),
    holds_something=lambda path: has_content(path / VISITS) or has_content(path / FRAMES),
    error=FramesError,
)


class FrameSet(ResumableFolder[FramesManifest]):
    """A directory of frames."""

    KIND = FRAME_SET

    def has_visit(self, number: int) -> bool:
        """Whether a visit is whole."""
        return self._visit(number).is_file()

    def save_visit(self, number: int, frames: Sequence[Frame]) -> None:
        """Keep the frames of a visit, whose pictures are written."""
        make_folder(self.path / VISITS)
        write_atomic(self._visit(number), _VISIT.dump_json(list(frames)) + b"\n")

    def visit(self, number: int) -> list[Frame]:
        """The frames of a visit.

        Raises:
            FramesError: it is damaged.
        """
        file = self._visit(number)
        try:
            return _VISIT.validate_json(read_bytes(file))
        except ValidationError as error:
            raise FramesError(
                f"{file} is damaged: {first_problem(error)}; remove it and draw again"
            ) from None

    def write(self, frames: Sequence[Frame]) -> None:
        """Replace ``frames.jsonl`` as a whole."""
        lines = (each.model_dump_json(exclude_defaults=True) + "\n" for each in frames)
        write_atomic(self.path / FRAMES, "".join(lines))

    def frames(self) -> Iterator[Frame]:
        """The frames, in order.

        Raises:
            FramesError: the file is not there, or a line is damaged; the message names it.
        """
        file = self.path / FRAMES
        if not file.is_file():
            raise FramesError(
                f"{self.path} has no {FRAMES} yet; run its er-gym data frames again until it ends"
            )
        with file.open("rb") as lines:
            for number, line in enumerate(lines, 1):
                try:
                    yield Frame.model_validate_json(line)
                except ValidationError as error:
                    raise FramesError(
                        f"{file}:{number}: {first_problem(error, 'the line')}; remove the file and "
                        "draw again"
                    ) from None

    def _visit(self, number: int) -> Path:
        return self.path / VISITS / f"{visit_name(number)}.json"


def is_frame_set(path: Path) -> bool:
    """Whether a directory holds frames."""
    return (path / MANIFEST).is_file()


def visit_name(number: int) -> str:
    """The name of a visit in file names."""
    return f"{number:05}"
