"""Renders frames: it loads a room, opens or switches some objects, and takes many poses.

The frames depend only on the seed and the visit's number. The poses are those that an agent takes
in an episode: the start pose, the poses to which ``navigate to`` leads, and other reachable
positions, with the rotations and tilts of agents.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.data.cells import cells_of
from er_gym.data.frames import PICTURES, Frame, FrameSet, visit_name
from er_gym.data.pictures import encode_picture
from er_gym.data.trajectory import PictureRecord, SeenObject
from er_gym.envs import skills
from er_gym.envs.legality import affordances, available_objects
from er_gym.envs.perception import Perception, type_mask, type_names
from er_gym.rollout.worker_pool import LostJob, run_jobs
from er_gym.tasks import verbs
from er_gym.tasks.arrangement import Arrangement, set_up_scene
from er_gym.tasks.task import AgentPose, Task
from er_gym.thor import make_controller
from er_gym.writing import make_folder, write_new

VISIT = 16
"""Frames of a visit. To set a room up takes as long as some of them."""
_OPENED, _SWITCHED = 0.12, 0.3
"""The shares of things that are opened, and switched on or off, at the beginning of a visit."""
_IN_FRONT, _OPEN_IT, _AROUND = 0.5, 0.5, 0.06
"""The shares of frames that are taken in front of a thing, of such openable things that are opened
or closed then, and of frames with a look around."""
_DIAGONAL = 0.2
"""The share of other poses that are turned by 45 degrees, as at the start of an episode."""
_HORIZONS, _HORIZON_SHARES = (-30.0, 0.0, 30.0, 60.0), (0.05, 0.55, 0.3, 0.1)
_AHEAD = "ahead"


class DrawingError(RuntimeError):
    """A room could not be drawn."""


@dataclass(frozen=True)
class Room:
    """A room as it is found at the beginning of a visit."""

    scene: str
    arrangement: Arrangement


@dataclass(frozen=True)
class Visit:
    """A visit to a room.

    Attributes:
        number: with the seed, it determines all random choices of the visit.
        room: the room.
    """

    number: int
    room: Room


@dataclass(frozen=True)
class Camera:
    """How frames are drawn.

    Attributes:
        path: the directory of the frames.
        env: the environment's arguments ``width``, ``height``, ``field_of_view``, ``grid_size``
            and ``visibility_distance``, and the ``backend``.
        form, quality: of the pictures' files.
        seed: of everything that is drawn.
    """

    path: Path
    env: Mapping[str, Any]
    form: str
    quality: int
    seed: int


def rooms_of(tasks: Iterable[Task]) -> list[Room]:
    """The rooms of tasks, each arrangement once, sorted by name."""
    found = {
        (task.scene, task.arrangement.layout): Room(task.scene, task.arrangement) for task in tasks
    }
    return [found[name] for name in sorted(found)]


def visits(rooms: Sequence[Room], number: int, seed: int) -> list[Visit]:
    """The visits that give so many frames: all rooms in a random order, repeatedly."""
    order = np.random.default_rng([seed]).permutation(len(rooms)).tolist()
    return [Visit(k, rooms[order[k % len(rooms)]]) for k in range(-(-number // VISIT))]


def draw_frames(
    frames: FrameSet, camera: Camera, todo: Sequence[Visit], *, workers: int
) -> Iterator[int]:
    """Render the missing visits; yields the number of frames of each visit once it is written.

    Raises:
        DrawingError: a process died at every try.
        WorkerSetupError: the simulator cannot be started.
    """
    missing = [each for each in todo if not frames.has_visit(each.number)]
    with closing(run_jobs(partial(_Photographer, camera), missing, workers=workers)) as results:
        for visit, drawn in results:
            if isinstance(drawn, LostJob):
                raise DrawingError(f"{visit.room.scene}: {drawn}; run the command again")
            frames.save_visit(visit.number, drawn)
            yield len(drawn)


class _Photographer:
    """Visits rooms, in a process of its own."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._controller: Any = None

    def __call__(self, visit: Visit) -> list[Frame]:
        room = visit.room
        if self._controller is None:
            self._controller = _started(room.scene, self._camera.env)
        return list(_Tour(self._camera, self._controller, visit).frames())

    def close(self) -> None:
        if self._controller is not None:
            self._controller.stop()


def _started(scene: str, env: Mapping[str, Any]) -> Any:
    """A controller as :class:`~er_gym.envs.embodied_env.EmbodiedEnv` starts it."""
    return make_controller(
        env["backend"],
        scene=scene,
        width=env["width"],
        height=env["height"],
        fieldOfView=env["field_of_view"],
        gridSize=env["grid_size"],
        visibilityDistance=env["visibility_distance"],
        snapToGrid=False,
        renderInstanceSegmentation=True,
    )


class _Tour:
    """A visit: the room is set up and changed, then looked at."""

    def __init__(self, camera: Camera, controller: Any, visit: Visit) -> None:
        self._camera, self._controller, self._visit = camera, controller, visit
        self._draw = np.random.default_rng([camera.seed, visit.number])
        room = visit.room
        bounds = set_up_scene(controller, room.scene, room.arrangement).metadata["sceneBounds"]
        env = camera.env
        self._floor = skills.reachable(controller, (env["backend"], room.scene, env["grid_size"]))
        self._start = skills.start_pose(bounds, self._floor)

    def frames(self) -> Iterator[Frame]:
        now = self._looked(self._start)
        self._change(now)
        for number in range(VISIT):
            at = ""
            if number == 0:
                now = self._looked(self._start)
            elif self._draw.random() < _IN_FRONT:
                now, at = self._in_front_of_something(now)
            else:
                now = self._looked(self._any_pose())
            views: Mapping[str, Perception] = {}
            if self._draw.random() < _AROUND:
                views = skills.observe(self._controller).views
            yield self._frame(f"{visit_name(self._visit.number)}-{number:02}", now, at, views)

    # -- poses and changes -----------------------------------------------------------------------

    def _looked(self, pose: AgentPose) -> Perception:
        perception = skills.place(self._controller, pose, force=True).perception
        assert perception is not None
        return perception

    def _any_pose(self) -> AgentPose:
        draw, places = self._draw, self._floor.positions
        x, y, z = places[draw.integers(len(places))].tolist()
        diagonal = 45.0 * (draw.random() < _DIAGONAL)
        horizon = draw.choice(_HORIZONS, p=_HORIZON_SHARES)
        return AgentPose(x, y, z, 90.0 * int(draw.integers(4)) + diagonal, float(horizon))

    def _change(self, now: Perception) -> None:
        """Open some things, and switch some on or off."""
        table = now.objects
        for row in np.flatnonzero(table.has["openable"]).tolist():
            if self._draw.random() < _OPENED:
                self._open_or_close(now, row)
        for row in np.flatnonzero(table.has["toggleable"]).tolist():
            if self._draw.random() < _SWITCHED:
                action = "ToggleObjectOff" if table.has["isToggled"][row] else "ToggleObjectOn"
                self._do(action, table.ids[row])

    def _in_front_of_something(self, now: Perception) -> tuple[Perception, str]:
        """Go to a thing as ``navigate to`` does; perhaps it is opened or closed then."""
        table = now.objects
        rows = np.flatnonzero(affordances(table).within > 0)
        # Each type as often as any other: most rooms have many cabinets and one fridge.
        kind = self._draw.choice(np.unique(table.kinds[rows]))
        row = int(self._draw.choice(rows[table.kinds[rows] == kind]))
        there = skills.navigate(self._controller, now, row, self._floor)
        if not there.success:
            return self._looked(self._any_pose()), ""
        if table.has["openable"][row] and self._draw.random() < _OPEN_IT:
            self._open_or_close(now, row)
            there = replace(there, perception=self._looked(_pose(there, now)))
        return there.perception or now, table.ids[row]

    def _open_or_close(self, now: Perception, row: int) -> None:
        table = now.objects
        action = "CloseObject" if table.has["isOpen"][row] else "OpenObject"
        self._do(action, table.ids[row])

    def _do(self, action: str, object_id: str) -> None:
        """What cannot be done, such as opening a door against the agent, is left undone."""
        self._controller.step(
            action=action, objectId=object_id, forceAction=True, renderImage=False
        )

    # -- the frame -------------------------------------------------------------------------------

    def _frame(self, name: str, now: Perception, at: str, views: Mapping[str, Perception]) -> Frame:
        available = available_objects(now, at)
        clear = [now.objects.kinds[available.navigable]]
        clear += [view.objects.kinds[available_objects(view).navigable] for view in views.values()]
        held = now.objects.held
        room = {now.objects.type_of(k) for k in range(len(now.objects)) if k != held}
        pose = now.pose
        covers, cells = cells_of(now)
        return Frame(
            id=name,
            scene=self._visit.room.scene,
            layout=self._visit.room.arrangement.layout,
            x=round(pose.x, 4),
            z=round(pose.z, 4),
            rotation=pose.rotation,
            horizon=pose.horizon,
            pictures=[
                self._picture(name, direction, each.frame)
                for direction, each in {_AHEAD: now, **views}.items()
            ],
            view=_seen(now),
            views={direction: _seen(view) for direction, view in views.items()},
            navigable=list(type_names(type_mask(np.concatenate(clear)))),
            interactable=list(available.in_reach),
            absent=sorted(room - {*now.visible_names} - verbs.NOWHERE),
            covers=covers,
            cells=cells,
        )

    def _picture(self, name: str, direction: str, rgb: NDArray[np.uint8] | None) -> PictureRecord:
        assert rgb is not None
        camera = self._camera
        visit, _, number = name.partition("-")
        stem = number if direction == _AHEAD else f"{number}-{direction}"
        path = f"{PICTURES}/{visit}/{stem}.{camera.form}"
        make_folder(camera.path / PICTURES / visit)
        data = encode_picture(rgb, form=camera.form, quality=camera.quality)
        write_new(camera.path / path, data)
        height, width, _ = rgb.shape
        return PictureRecord(path=path, direction=direction, width=width, height=height)


def _pose(there: skills.Outcome, before: Perception) -> AgentPose:
    return (there.perception or before).pose


def _seen(perception: Perception) -> list[SeenObject]:
    return [SeenObject.of(view) for view in perception.object_views]
