"""Which pictures a trajectory must have, where their files are, and what they must show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.data.collection import PARTS
from er_gym.data.comparing import compared
from er_gym.data.pictures import Encoding, difference
from er_gym.data.trajectory import PictureRecord, Trajectory
from er_gym.rollout.run_directory import PICTURES
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem, inside

_AHEAD = "ahead"


@dataclass(frozen=True)
class Album:
    """How a part of a collection keeps pictures.

    Attributes:
        recorded: whether it has any.
        folder: the collection's, to compare files; None to compare the records alone.
        encoding: how the files were written; None where nothing says it.
    """

    recorded: bool = True
    folder: Path | None = None
    encoding: Encoding | None = None

    def problems(
        self,
        trajectory: Trajectory,
        index: int,
        obs: Mapping[str, Any],
        info: Mapping[str, Any],
    ) -> Iterator[str]:
        """What is wrong with the pictures of a turn.

        Args:
            trajectory: whose turns before are right.
            index: of the turn.
            obs, info: what the environment gave before the turn's action, with ``rgb`` if files are
                compared.
        """
        turn = trajectory.turns[index]
        before = [one for each in trajectory.turns[:index] for one in each.pictures]
        frames: Mapping[str, NDArray[np.uint8] | None] = info["views"] or {_AHEAD: obs.get("rgb")}
        shown = [each.direction for each in turn.pictures]
        failed = index > 0 and not trajectory.turns[index - 1].success
        if not self.recorded:
            expected: list[str] = []
        elif failed and not info["views"]:
            expected = self._after_a_failure(before, frames[_AHEAD], shown)
        else:
            expected = [*frames]
        yield from compared("the directions of pictures", shown, expected)
        if shown != expected:
            return
        for number, picture in enumerate(turn.pictures, len(before)):
            yield from self._one(trajectory, number, picture, frames[picture.direction])

    def _after_a_failure(
        self, before: list[PictureRecord], frame: NDArray[np.uint8] | None, shown: list[str]
    ) -> list[str]:
        """After an action that failed the view is shown only if it is not the last one shown."""
        if self.folder is None or frame is None or not before:
            return shown if shown in ([], [_AHEAD]) else [_AHEAD]
        try:
            last = read_bytes(inside(self.folder, before[-1].path))
        except ValueError:
            return shown
        return [_AHEAD] if difference(last, frame) else []

    def _one(
        self,
        trajectory: Trajectory,
        number: int,
        picture: PictureRecord,
        frame: NDArray[np.uint8] | None,
    ) -> Iterator[str]:
        form = self.encoding.form if self.encoding else Path(picture.path).suffix[1:]
        place = f"{PARTS}/{trajectory.part}/{PICTURES}/{file_stem(trajectory.id)}"
        yield from compared("path", picture.path, f"{place}/{number:03}.{form}", "the id")
        if frame is None or self.folder is None:
            return
        high, wide, _ = frame.shape
        yield from compared("width and height", (picture.width, picture.height), (wide, high))
        try:
            recorded = read_bytes(inside(self.folder, picture.path))
        except ValueError as error:
            yield f"picture {picture.path} cannot be read: {error}"
            return
        if problem := difference(recorded, frame, self.encoding):
            yield f"picture {picture.path} {problem}"
