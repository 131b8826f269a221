"""What the agent sees.

An object is visible when it is no farther than the visibility distance from the agent (see
:mod:`er_gym.sim.space.reach`) and one of its sample points is inside the camera's frustum and on an
unobstructed line from the camera.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.rays import blocked_by
from er_gym.sim.space.reach import Outlines
from er_gym.sim.world import Agent, World

NEAR_PLANE = 0.1
"""Distance of the camera's near plane, metres."""
_ARRANGEMENTS = 512
_ANSWERS = 512

Found = TypeVar("Found")


@dataclass
class Sights:
    """What can be seen from where, in one arrangement of a scene's objects.

    Episodes begin alike and return to the same states, so what was found out is kept: see
    :func:`sights`.

    Attributes:
        points: (P, 3) sample points of all objects, metres; of: (P,) whose each is.
        low, high: (M, 3) corners of the boxes that block lines of sight; solid_of: (M,) whose.
        hidden: (N,) objects that are shut away or are no more.
        own: (N, N) bool, row i: object i and all that it lies in, which do not hide it.
        rows: (K,) the objects that are there; outlines: theirs, from above.
    """

    points: NDArray[np.float32]
    of: NDArray[np.int16]
    low: NDArray[np.float32]
    high: NDArray[np.float32]
    solid_of: NDArray[np.int64]
    hidden: NDArray[np.bool_]
    own: NDArray[np.bool_]
    rows: NDArray[np.int64]
    outlines: Outlines
    _answers: OrderedDict[Any, Any] = field(default_factory=OrderedDict)

    @staticmethod
    def of_world(world: World) -> Sights:
        """For the world as it is now."""
        rows = np.flatnonzero(world.exists).tolist()
        points = [world.sample_points(i) for i in rows]
        own = np.eye(len(world), dtype=bool)
        for i in rows:
            if world.parents[i]:
                own[i, list(world.ancestors(i))] = True
        return Sights(
            np.concatenate(points).astype(np.float32),
            np.repeat(rows, [len(p) for p in points]).astype(np.int16),
            *world.solids(),
            world.hidden.copy(),
            own,
            np.array(rows),
            Outlines.of([world.shape(i) for i in rows]),
        )

    def clear(
        self, eyes: NDArray[np.float64], points: NDArray[np.float32], of: NDArray[np.int16]
    ) -> NDArray[np.bool_]:
        """(E, P) which points nothing hides from which (E, 3) camera positions.

        An object is not hidden by its own box, nor by what it lies in or on. What is shut away is
        hidden from everywhere.
        """
        origins = np.repeat(eyes.astype(np.float32), len(points), axis=0)
        targets = np.tile(points, (len(eyes), 1))
        blocked = blocked_by(origins, targets, self.low, self.high)
        blocked = blocked.reshape(len(eyes), len(points), -1)
        blocked &= ~self.own[of][:, self.solid_of]
        return np.asarray(~blocked.any(axis=2) & ~self.hidden[of])

    def within(self, position: NDArray[np.float64], distance: float) -> NDArray[np.bool_]:
        """(N,) which objects are no farther than a distance from a (3,) position, metres."""
        found = np.zeros(len(self.own), dtype=bool)
        found[self.rows] = self.outlines.gaps(position[None, [0, 2]])[0] <= distance
        return found

    def remembered(self, question: Any, answer: Callable[[], Found]) -> Found:
        """The answer to a question about this arrangement, worked out once."""
        found: Found | None = self._answers.get(question)
        if found is None:
            found = self._answers[question] = answer()
            if len(self._answers) > _ANSWERS:
                self._answers.popitem(last=False)
        return found


@dataclass
class _Eye:
    """What has been found out for one camera position: which points it has looked at and sees."""

    asked: NDArray[np.bool_]
    clear: NDArray[np.bool_]

    @staticmethod
    def shut(count: int) -> _Eye:
        return _Eye(np.zeros(count, dtype=bool), np.zeros(count, dtype=bool))

    def look_at(
        self, known: Sights, camera: NDArray[np.float64], points: NDArray[np.bool_]
    ) -> None:
        new = np.flatnonzero(points & ~self.asked)
        if len(new):
            self.clear[new] = known.clear(camera[None], known.points[new], known.of[new])[0]
            self.asked[new] = True


_known: OrderedDict[bytes, Sights] = OrderedDict()


def sights(world: World) -> Sights:
    """The sights of the world as it is now: those found before, if it was like this before."""
    found = world.derived.get("sights")
    if found is None:
        key = _arrangement(world)
        found = _known.get(key)
        if found is None:
            found = _known[key] = Sights.of_world(world)
            if len(_known) > _ARRANGEMENTS:
                _known.popitem(last=False)
        world.derived["sights"] = found
    return found  # type: ignore[return-value]  # the only writer is above


def _arrangement(world: World) -> bytes:
    """A digest of what lines of sight depend on; where the hand holds things is not part of it."""
    low, high = world.low.copy(), world.high.copy()
    held = world.in_hand
    low[held] = high[held] = 0.0
    digest = blake2b(world.scene.name.encode(), digest_size=16)
    for array in (low, high, world.rotation, world.hidden, world.exists):
        digest.update(array.tobytes())
    digest.update(repr((held, world.parents)).encode())
    return digest.digest()


def in_frustum(
    offsets: NDArray[np.float64],
    rotation: NDArray[np.float64] | float,
    horizon: NDArray[np.float64] | float,
    field_of_view: float,
    aspect: float,
) -> NDArray[np.bool_]:
    """Which points a camera has in its picture.

    Args:
        offsets: (..., 3) from the camera to the points, metres, world frame.
        rotation, horizon: degrees, broadcast against the points.
        field_of_view: vertical, degrees. aspect: the picture's width by its height.
    """
    yaw, pitch = np.radians(rotation), np.radians(horizon)
    x, y, z = offsets[..., 0], offsets[..., 1], offsets[..., 2]
    right = x * np.cos(yaw) - z * np.sin(yaw)
    ahead = x * np.sin(yaw) + z * np.cos(yaw)
    forward = ahead * np.cos(pitch) - y * np.sin(pitch)
    up = ahead * np.sin(pitch) + y * np.cos(pitch)
    vertical = forward * np.tan(np.radians(field_of_view) / 2)
    return np.asarray(
        (forward > NEAR_PLANE) & (np.abs(up) <= vertical) & (np.abs(right) <= vertical * aspect)
    )


def visible(world: World, agent: Agent | None = None) -> NDArray[np.bool_]:
    """(N,) which objects the agent sees, from where it is or from another pose."""
    agent = agent or world.agent
    known, settings = sights(world), world.settings
    pose = (*agent.position.tolist(), agent.standing)
    lens = (
        agent.rotation,
        agent.horizon,
        settings.field_of_view,
        settings.width / settings.height,
        settings.visibility_distance,
    )

    def look() -> NDArray[np.bool_]:
        offsets = known.points - agent.camera
        asked = in_frustum(offsets, *lens[:4])
        asked &= known.within(agent.position, lens[4])[known.of]
        eye = known.remembered(pose, lambda: _Eye.shut(len(known.points)))
        eye.look_at(known, agent.camera, asked)
        result = np.zeros(len(world), dtype=bool)
        result[known.of[asked & eye.clear]] = True
        return result

    result = known.remembered((pose, lens), look).copy()
    result[[i for i in world.in_hand if not world.hidden[i]]] = True
    return result
