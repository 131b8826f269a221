"""Where each trajectory of a collection is in its file, so that it can be read by itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict, ValidationError

from er_gym.data.collection import TRAJECTORIES, Collection, damaged_line
from er_gym.data.trajectory import Trajectory


@dataclass(frozen=True)
class Line:
    """A trajectory's line.

    Attributes:
        offset: of its first byte.
        id, part, scene, task_id: the trajectory's.
    """

    offset: int
    id: str
    part: str
    scene: str
    task_id: str


class _Head(BaseModel):
    model_config = ConfigDict(extra="ignore")

    id: str
    part: str = ""
    scene: str
    task_id: str


def lines_of(collection: Collection) -> Iterator[Line]:
    """The lines of a collection's trajectories, in order. Only their heads are checked.

    Raises:
        CollectionError: the file is not there, or a line is damaged; the message names it.
    """
    path = collection.path / TRAJECTORIES
    with collection.open_lines() as file:
        offset = 0
        for number, line in enumerate(file, 1):
            try:
                head = _Head.model_validate_json(line)
            except ValidationError as error:
                raise damaged_line(f"{path}:{number}", error) from error
            yield Line(offset, head.id, head.part, head.scene, head.task_id)
            offset += len(line)


def trajectory_at(collection: Collection, offset: int) -> Trajectory:
    """The trajectory whose line begins at an offset.

    Raises:
        CollectionError: the line is damaged.
    """
    with collection.open_lines() as file:
        file.seek(offset)
        line = file.readline()
    try:
        return Trajectory.model_validate_json(line)
    except ValidationError as error:
        path = collection.path / TRAJECTORIES
        raise damaged_line(f"{path}, byte {offset}", error) from error
