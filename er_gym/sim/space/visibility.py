"""What the agent sees.

An object is visible when it is no farther than the visibility distance from the agent (see
:mod:`er_gym.sim.space.reach`) and one of its sample points is inside the camera's frustum and on an
unobstructed line from the camera.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import blake2b
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene
from er_gym.sim.space.rays import blocked_by
from er_gym.sim.space.reach import Outlines
from er_gym.sim.world import Agent, Settings, World

NEAR_PLANE = 0.1
"""Distance of the camera's near plane, metres."""
_ARRANGEMENTS = 512
_ANSWERS = 512

Found = TypeVar("Found")


@dataclass
class Sights:
    """What can be seen from where, in one arrangement of a scene's objects.

    Episodes begin alike and return to the same states, so what was found out is kept: see
    :func:`sights`. An arrangement differs from the recorded one in a few objects, so what was found
    out about that holds but for those: see :meth:`clear_from`.

    Attributes:
        points: (P, 3) sample points of all objects, metres; of: (P,) whose each is.
        low, high: (M, 3) corners of the boxes that block lines of sight; solid_of: (M,) whose.
        hidden: (N,) objects that are shut away or are no more.
        own: (N, M) bool, row i: the boxes of object i and of all that it lies in, which do not hide
            it.
        rows: (K,) the objects that are there; outlines: theirs, from above.
        change: how this differs from the arrangement that was recorded, None if it is that one.
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
    change: _Change | None = None
    _answers: OrderedDict[Any, Any] = field(default_factory=OrderedDict)

    @staticmethod
    def of_world(world: World) -> Sights:
        """For the world as it is now."""
        rows = np.flatnonzero(world.exists).tolist()
        points = [world.sample_points(i) for i in rows]
        low, high, solid_of = world.solids()
        own = np.eye(len(world), dtype=bool)
        for i in rows:
            if world.parents[i]:
                own[i, list(world.ancestors(i))] = True
        found = Sights(
            np.concatenate(points).astype(np.float32),
            np.repeat(rows, [len(p) for p in points]).astype(np.int16),
            low,
            high,
            solid_of,
            world.hidden.copy(),
            own[:, solid_of],
            np.array(rows),
            Outlines.of([world.shape(i) for i in rows]),
        )
        if not world.untouched:
            found.change = _Change.between(_as_recorded(world.scene.name), found, world)
        return found

    def blocking(
        self,
        eyes: NDArray[np.float64],
        points: NDArray[np.float32],
        of: NDArray[np.int16],
        boxes: NDArray[np.intp] | slice = slice(None),
    ) -> NDArray[np.uint8]:
        """(R,) how many of some boxes stand between (R, 3) or (1, 3) eyes and (R, 3) points.

        An object is not hidden by its own box, nor by what it lies in or on.
        """
        blocked = blocked_by(eyes.astype(np.float32), points, self.low[boxes], self.high[boxes])
        blocked &= ~self.own[:, boxes][of]
        return np.asarray(blocked.sum(axis=1, dtype=np.uint8))

    def clear(
        self, eyes: NDArray[np.float64], points: NDArray[np.float32], of: NDArray[np.int16]
    ) -> NDArray[np.bool_]:
        """(E, P) which points nothing hides from which (E, 3) camera positions.

        What is shut away is hidden from everywhere.
        """
        origins = np.repeat(eyes, len(points), axis=0)
        blocking = self.blocking(origins, np.tile(points, (len(eyes), 1)), np.tile(of, len(eyes)))
        return np.asarray((blocking.reshape(len(eyes), -1) == 0) & ~self.hidden[of])

    def clear_from(
        self, camera: NDArray[np.float64], asked: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """(P,) which of the points that are asked for nothing hides from a (3,) camera position."""
        if self.change is None:
            blocking = self._blocking_from(camera, asked)
        else:
            blocking = self.change.blocking_from(self, camera, asked)
        return np.asarray(asked & (blocking == 0) & ~self.hidden[self.of])

    def _blocking_from(
        self, camera: NDArray[np.float64], asked: NDArray[np.bool_]
    ) -> NDArray[np.uint8]:
        """(P,) how many boxes hide each point that is asked for; kept for each camera position."""
        known, blocking = self.remembered(
            tuple(camera.tolist()),
            lambda: (np.zeros(len(self.of), dtype=bool), np.zeros(len(self.of), dtype=np.uint8)),
        )
        new = np.flatnonzero(asked & ~known)
        if len(new):
            blocking[new] = self.blocking(camera[None], self.points[new], self.of[new])
            known[new] = True
        return blocking

    def within(self, position: NDArray[np.float64], distance: float) -> NDArray[np.bool_]:
        """(N,) which objects are no farther than a distance from a (3,) position, metres."""
        found = np.zeros(len(self.hidden), dtype=bool)
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


@dataclass(frozen=True)
class _Change:
    """How an arrangement differs from the recorded one.

    Attributes:
        recorded: what it differs from.
        same: (P,) for each sample point the recorded one that it is, -1 for points of objects that
            have been moved, uncovered or shut away.
        gone: the recorded boxes of such objects; come: their boxes now.
    """

    recorded: Sights
    same: NDArray[np.int64]
    gone: NDArray[np.intp]
    come: NDArray[np.intp]

    @staticmethod
    def between(recorded: Sights, now: Sights, world: World) -> _Change:
        changed = np.ones(len(now.hidden), dtype=bool)
        count = len(recorded.hidden)
        changed[:count] = now.hidden[:count] != recorded.hidden
        changed[world.touched()] = True
        # Objects that are as recorded have as many points as recorded, in the same order.
        kept_now, kept_then = ~changed[now.of], ~changed[recorded.of]
        same = np.full(len(now.of), -1)
        same[kept_now] = np.flatnonzero(kept_then)
        return _Change(
            recorded,
            same,
            np.flatnonzero(changed[recorded.solid_of]),
            np.flatnonzero(changed[now.solid_of]),
        )

    def blocking_from(
        self, now: Sights, camera: NDArray[np.float64], asked: NDArray[np.bool_]
    ) -> NDArray[np.uint8]:
        """As for the recorded arrangement, less the boxes that are gone, and those that have come.

        Points of objects that have changed are looked at anew.
        """
        blocking = np.zeros(len(now.of), dtype=np.uint8)
        old = np.flatnonzero(asked & (self.same >= 0))
        then = np.zeros(len(self.recorded.of), dtype=bool)
        then[self.same[old]] = True
        before = self.recorded._blocking_from(camera, then)[self.same[old]]
        sight = (camera[None], now.points[old], now.of[old])
        blocking[old] = (
            before - self.recorded.blocking(*sight, self.gone) + now.blocking(*sight, self.come)
        )
        new = np.flatnonzero(asked & (self.same < 0))
        blocking[new] = now.blocking(camera[None], now.points[new], now.of[new])
        return blocking


@lru_cache(maxsize=128)
def _as_recorded(scene_name: str) -> Sights:
    return Sights.of_world(World.load(load_scene(scene_name), Settings()))


_known: OrderedDict[bytes, Sights] = OrderedDict()


def sights(world: World) -> Sights:
    """The sights of the world as it is now: those found before, if it was like this before."""
    found = world.derived.get("sights")
    if found is None:
        if world.untouched:
            found = _as_recorded(world.scene.name)
        else:
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
        result = np.zeros(len(world), dtype=bool)
        result[known.of[known.clear_from(agent.camera, asked)]] = True
        return result

    result = known.remembered((pose, lens), look).copy()
    result[[i for i in world.in_hand if not world.hidden[i]]] = True
    return result
