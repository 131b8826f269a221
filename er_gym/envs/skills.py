"""Skills: high-level verbs as calls of the AI2-THOR controller.

A skill takes the controller and an object's row in a table, and returns an :class:`Outcome`. It
does not check whether it is legal now; :mod:`er_gym.envs.legality` does. No skill keeps an event
while it calls the controller; :mod:`er_gym.envs.perception` says why.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import chain
from math import atan2, degrees, hypot
from operator import itemgetter
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from er_gym.envs import feedback_words
from er_gym.envs.perception import Perception, perception_of
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.task import AgentPose
from er_gym.thor import ObjectTable
from er_gym.thor.calls import Calls, Result, calls_of
from er_gym.thor.floor import floor_of

FORWARD_STEP = 0.5
"""The length of a ``move forward`` without obstacles, metres."""
_COMFORTABLE = 0.7
"""The preferred distance from an object's centre, metres."""
_POSITIONS_AT_ONCE = 12
_ROTATIONS = (0, 90, 180, 270)
_HORIZONS = (-30, 0, 30, 60)
_DIRECTIONS = np.array([(r, h) for r in _ROTATIONS for h in _HORIZONS])
VIEWS = ("right", "behind", "left")
"""The directions that ``observe`` shows, in this order."""
_xyz = itemgetter(*"xyz")

Position = Sequence[float]
"""x, y and z, metres."""
Angle = TypeVar("Angle", float, NDArray[Any])


class Reachable:
    """The positions where the agent can stand in a scene.

    Args:
        positions: the ``actionReturn`` of GetReachablePositions, metres.
    """

    def __init__(self, positions: Sequence[Mapping[str, float]]) -> None:
        flat = chain.from_iterable(map(_xyz, positions))
        xyz = np.fromiter(flat, np.float64, 3 * len(positions)).reshape(-1, 3)
        self._xyz = xyz[np.lexsort((xyz[:, 2], xyz[:, 0]))]

    @property
    def positions(self) -> NDArray[np.float64]:
        """(N, 3) x, y and z of each position, metres; sorted by x, then z."""
        return self._xyz

    def nearest_to(self, x: float, z: float) -> Iterator[list[Position]]:
        """The positions in batches, nearest to the point (x, z) first."""
        distance = np.hypot(self._xyz[:, 0] - x, self._xyz[:, 2] - z).round(6)
        nearest_first = self._xyz[np.argsort(distance, kind="stable")]
        for first in range(0, len(nearest_first), _POSITIONS_AT_ONCE):
            yield nearest_first[first : first + _POSITIONS_AT_ONCE].tolist()


_reachable: dict[Hashable, Reachable] = {}


def reachable(controller: Any, scene: Hashable) -> Reachable:
    """The positions where the agent can stand. A process asks the controller once for each key.

    Args:
        scene: a key: the scene, and whatever else the positions depend on.
    """
    if scene not in _reachable:
        _reachable[scene] = Reachable(floor_of(controller))
    return _reachable[scene]


@dataclass(frozen=True)
class Outcome:
    """The outcome of a skill.

    Attributes:
        perception: what the agent perceives afterwards; None if that has not changed.
        success: whether the skill succeeded.
        problem: why it failed, in words for the agent; ``""`` if it succeeded, or if only ``error``
            says why.
        views: after ``observe``, direction to what the agent perceives there.
        error: AI2-THOR's message, ``""`` for none; not for the agent.
    """

    perception: Perception | None
    success: bool
    problem: str = ""
    views: Mapping[str, Perception] = field(default_factory=dict)
    error: str = ""


def _outcome(calls: Calls, result: Result) -> Outcome:
    success, error = result
    return Outcome(perception_of(calls.seen()), success, error=error)


def place(controller: Any, pose: AgentPose, *, force: bool = False) -> Outcome:
    """Teleport the agent to a pose; ``force`` skips AI2-THOR's check for room."""
    calls = calls_of(controller)
    position = pose.x, pose.y, pose.z
    return _outcome(
        calls, calls.teleport(position, pose.rotation, pose.horizon, pose.standing, force)
    )


def look(controller: Any) -> Perception:
    """What the agent perceives now; a picture is drawn if the controller draws."""
    calls = calls_of(controller)
    calls.act("Pass")
    return perception_of(calls.seen())


def look_from(controller: Any, pose: AgentPose) -> Perception:
    """What the agent perceives at a pose, where it stays."""
    there = place(controller, pose, force=True).perception
    assert there is not None  # a teleport tells what is seen
    return there


def start_pose(bounds: Mapping[str, Any], floor: Reachable) -> AgentPose:
    """The start pose: the reachable position nearest to a corner of the scene's bounds.

    The agent looks diagonally into the room, at 45, 135, 225 or 315 degrees.

    Args:
        bounds: ``sceneBounds`` of an event's metadata.
    """
    return _start_pose(floor, *_xyz(bounds["center"]), *_xyz(bounds["size"]))


@lru_cache(maxsize=1024)
def _start_pose(
    floor: Reachable, cx: float, _cy: float, cz: float, width: float, _height: float, depth: float
) -> AgentPose:
    hx, hz = width / 2, depth / 2
    corners = (
        (cx - hx, cz - hz, 45.0),
        (cx - hx, cz + hz, 135.0),
        (cx + hx, cz + hz, 225.0),
        (cx + hx, cz - hz, 315.0),
    )
    nearest = [(next(floor.nearest_to(x, z))[0], x, z, r) for x, z, r in corners]
    (x, y, z), _, _, rotation = min(nearest, key=lambda n: hypot(n[0][0] - n[1], n[0][2] - n[2]))
    return AgentPose(x, y, z, rotation)


def navigate(controller: Any, perception: Perception, goal: int, floor: Reachable) -> Outcome:
    """Go to the pose from which the agent sees and handles an object best.

    The search runs from the position nearest to the object's centre outwards, in batches. The first
    batch with poses from which the object is interactable decides: the agent takes the pose at the
    most comfortable distance that has the object in the middle of the picture.
    """
    objects = perception.objects
    object_id, centre = objects.ids[goal], tuple(objects.centre[goal].tolist())
    # Try the best pose of an empty room first: it mostly works, and its event says whether it does.
    # A held object is visible from everywhere.
    if goal != objects.held:
        there = place(controller, _best_view(floor, *centre))
        if there.success and _can_handle(there.perception, object_id):
            return there

    def discomfort(pose: AgentPose) -> float:
        view = _view((pose.x, pose.y, pose.z), centre)
        return _discomfort(*view, pose.rotation, pose.horizon)

    for positions in floor.nearest_to(centre[0], centre[2]):
        found = _interactable_poses(controller, object_id, positions, _ROTATIONS, _HORIZONS)
        if found:
            return place(controller, min(found, key=discomfort))
    problem = feedback_words.NO_WAY(thing=objects.type_of(goal))
    return replace(place(controller, perception.pose), success=False, problem=problem)


def _can_handle(perception: Perception | None, object_id: str) -> bool:
    row = None if perception is None else perception.objects.row.get(object_id)
    return perception is not None and row is not None and bool(perception.interactable[row])


def _interactable_poses(
    controller: Any,
    object_id: str,
    positions: Sequence[Position],
    rotations: Sequence[float],
    horizons: Sequence[float],
) -> list[AgentPose]:
    found = calls_of(controller).poses(object_id, positions, rotations, horizons)
    return [AgentPose(x, y, z, rotation, horizon) for x, y, z, rotation, horizon in found]


def _view(position: Position, centre: Position) -> tuple[float, float, float]:
    """A point seen from a position: distance in metres, degrees clockwise from +z, degrees down."""
    dx, dz = centre[0] - position[0], centre[2] - position[2]
    distance = hypot(dx, dz)
    eye = position[1] + 0.675
    return (
        distance,
        degrees(atan2(dx, dz)),
        degrees(atan2(eye - centre[1], max(distance, 0.1))),
    )


def _discomfort(
    distance: Angle, bearing: Angle, below: Angle, rotation: Angle, horizon: Angle
) -> Angle:
    """How uncomfortable a view is: 1 for every 45 degrees off, and for every metre off.

    Args:
        distance, bearing, below: see :func:`_view`.
        rotation, horizon: the direction in which the agent looks, degrees.
    """
    aside = abs((bearing - rotation + 180) % 360 - 180)
    amiss: Angle = aside / 45 + abs(below - horizon) / 45 + abs(distance - _COMFORTABLE)
    return amiss


@lru_cache(maxsize=16384)
def _best_view(floor: Reachable, x: float, y: float, z: float) -> AgentPose:
    """The most comfortable pose near a point if nothing were in the way.

    :func:`navigate` would choose this pose if it were among the interactable ones.
    """
    positions = next(floor.nearest_to(x, z))
    # math's functions, since the last digits of NumPy's differ between machines.
    views = np.array([_view(position, (x, y, z)) for position in positions])
    amiss = _discomfort(*views.T[..., None], *_DIRECTIONS.T)
    position, direction = divmod(int(amiss.argmin()), len(_DIRECTIONS))
    rotation, horizon = _DIRECTIONS[direction].tolist()
    there = positions[position]
    return AgentPose(there[0], there[1], there[2], rotation, horizon)


def observe(controller: Any) -> Outcome:
    """Look right, behind and left, and turn back."""

    calls = calls_of(controller)

    def turned() -> Perception:
        calls.turn_right(90.0)
        return perception_of(calls.seen())

    views = {view: turned() for view in VIEWS}
    return Outcome(turned(), True, views=views)


def move_forward(controller: Any, grid_size: float) -> Outcome:
    """Walk ahead, up to :data:`FORWARD_STEP` metres, in steps of the grid while there is room."""
    calls, taken, problem = calls_of(controller), 0.0, ""
    while taken < FORWARD_STEP - 1e-6:
        step = min(grid_size, FORWARD_STEP - taken)
        moved, problem = calls.move_ahead(step)
        if not moved:
            break
        taken += step
    return _outcome(calls, (taken > 0, "" if taken else problem))


def _part_to_put_into(objects: ObjectTable, row: int) -> str:
    """The id of the part that takes objects: a Sink's basin rather than the Sink."""
    part = f"{objects.ids[row]}|{BASIN_OF.get(objects.type_of(row), '')}"
    return part if part in objects.row else objects.ids[row]


def _put(calls: Calls, objects: ObjectTable, row: int) -> Result:
    verb = verbs.verb_named(verbs.PUT)
    part = _part_to_put_into(objects, row)
    return calls.act(verb.thor_action, objectId=part, **verb.parameters)


def _toggle(calls: Calls, objects: ObjectTable, row: int) -> Result:
    switch = row
    if objects.type_of(row) == "StoveBurner":
        # AI2-THOR's burners have no switch; the knob whose controlledObjects name one is it.
        for other, controlled in enumerate(objects.controlled):
            if row in controlled:
                switch = other
    action = "ToggleObjectOff" if objects.has["isToggled"][switch] else "ToggleObjectOn"
    # The agent must see the burner, not its knob.
    return calls.act(action, objectId=objects.ids[switch], forceAction=switch != row)


_OTHERWISE: Mapping[str, Callable[[Calls, ObjectTable, int], Result]] = {
    verbs.PUT: _put,
    verbs.TOGGLE: _toggle,
}
"""Verbs that need more than one call of their AI2-THOR action with the object's id."""


def interact(controller: Any, name: str, objects: ObjectTable, row: int) -> Outcome:
    """Do an interaction, such as "open", to an object."""
    calls = calls_of(controller)
    if name in _OTHERWISE:
        return _outcome(calls, _OTHERWISE[name](calls, objects, row))
    verb = verbs.verb_named(name)
    return _outcome(
        calls, calls.act(verb.thor_action, objectId=objects.ids[row], **verb.parameters)
    )


def act_without_object(controller: Any, name: str) -> Outcome:
    """Do a verb that takes no object, by its AI2-THOR action."""
    calls, verb = calls_of(controller), verbs.verb_named(name)
    return _outcome(calls, calls.act(verb.thor_action, **verb.parameters))
