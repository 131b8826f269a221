"""High-level verbs turned into calls of the AI2-THOR controller.

A skill takes the controller and an object's metadata and returns an :class:`Outcome`; whether it
may be used now is not its business (see :mod:`er_gym.envs.legality`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import atan2, degrees, hypot
from typing import Any

import numpy as np

from er_gym.envs.actions import STANDS_FOR
from er_gym.envs.legality import Objects
from er_gym.tasks import verbs
from er_gym.tasks.task import AgentPose

FORWARD_STEP = 0.5
"""How far "move forward" goes when nothing is in the way, metres."""
_COMFORTABLE = 0.7
"""How far from an object's middle one likes to stand, metres."""
_POSITIONS_AT_ONCE = 12
_ROTATIONS = (0, 90, 180, 270)
_HORIZONS = (-30, 0, 30, 60)
_VIEWS = ("right", "behind", "left")

Position = Mapping[str, float]


class Reachable:
    """Where the agent can stand in a scene: the ``actionReturn`` of GetReachablePositions."""

    def __init__(self, positions: Sequence[Position]) -> None:
        self._positions = [{axis: position[axis] for axis in "xyz"} for position in positions]
        self._xz = np.array([(p["x"], p["z"]) for p in positions]).reshape(-1, 2)
        self._best_views: dict[tuple[float, float, float], Mapping[str, float]] = {}

    def nearest_to(self, x: float, z: float) -> Iterator[list[Position]]:
        """The positions in batches, those nearest to a point first."""
        distance = np.hypot(self._xz[:, 0] - x, self._xz[:, 1] - z).round(6)
        order = np.lexsort((self._xz[:, 1], self._xz[:, 0], distance))
        for first in range(0, len(order), _POSITIONS_AT_ONCE):
            batch = order[first : first + _POSITIONS_AT_ONCE].tolist()
            yield [self._positions[k] for k in batch]

    def best_view(self, centre: Mapping[str, float]) -> Mapping[str, float]:
        """The pose near a point from which to look at it most comfortably, were nothing in the way.

        It is the one that :func:`navigate` would choose, were it among those to choose from.
        """
        key = (centre["x"], centre["y"], centre["z"])
        if key not in self._best_views:
            poses = [
                {**position, "rotation": rotation, "horizon": horizon}
                for position in next(self.nearest_to(centre["x"], centre["z"]))
                for rotation in _ROTATIONS
                for horizon in _HORIZONS
            ]
            self._best_views[key] = min(poses, key=lambda pose: _discomfort(pose, centre))
        return self._best_views[key]


@dataclass(frozen=True)
class Outcome:
    """What came of a skill.

    Attributes:
        event: the AI2-THOR event after it.
        success: whether it was done.
        problem: if not, why not.
        views: for "observe", direction to event.
    """

    event: Any
    success: bool
    problem: str = ""
    views: Mapping[str, Any] = field(default_factory=dict)


def _outcome(event: Any) -> Outcome:
    metadata = event.metadata
    return Outcome(event, metadata["lastActionSuccess"], metadata["errorMessage"])


def place(controller: Any, pose: AgentPose) -> Outcome:
    """Put the agent at a pose."""
    return _outcome(
        controller.step(
            action="TeleportFull",
            position={"x": pose.x, "y": pose.y, "z": pose.z},
            rotation={"x": 0.0, "y": pose.rotation, "z": 0.0},
            horizon=pose.horizon,
            standing=pose.standing,
        )
    )


def start_pose(metadata: Mapping[str, Any], reachable: Reachable) -> AgentPose:
    """Where episodes begin: the reachable position nearest to a corner of the scene's bounds.

    The agent looks diagonally into the room from there: 45, 135, 225 or 315 degrees.
    """
    bounds = metadata["sceneBounds"]
    cx, cz = bounds["center"]["x"], bounds["center"]["z"]
    hx, hz = bounds["size"]["x"] / 2, bounds["size"]["z"] / 2
    corners = (
        (cx - hx, cz - hz, 45.0),
        (cx - hx, cz + hz, 135.0),
        (cx + hx, cz + hz, 225.0),
        (cx + hx, cz - hz, 315.0),
    )
    nearest = [(next(reachable.nearest_to(x, z))[0], x, z, r) for x, z, r in corners]
    spot, _, _, rotation = min(nearest, key=lambda n: hypot(n[0]["x"] - n[1], n[0]["z"] - n[2]))
    return AgentPose(spot["x"], spot["y"], spot["z"], rotation)


def navigate(controller: Any, goal: Mapping[str, Any], reachable: Reachable) -> Outcome:
    """Go to where an object can best be seen and handled, facing it.

    Positions are tried from the nearest to the object's middle outwards; among the first from which
    it can be interacted with, the one that is at a comfortable distance and has it in the middle of
    the picture is taken.
    """
    centre = goal["axisAlignedBoundingBox"]["center"]
    # The pose that one would choose is mostly possible, and cheaper to ask for than all.
    wanted = reachable.best_view(centre)
    if _interactable_poses(controller, goal, [wanted], [wanted["rotation"]], [wanted["horizon"]]):
        return place(controller, _agent_pose(wanted))
    for positions in reachable.nearest_to(centre["x"], centre["z"]):
        found = _interactable_poses(controller, goal, positions, _ROTATIONS, _HORIZONS)
        if found:
            return place(
                controller, _agent_pose(min(found, key=lambda pose: _discomfort(pose, centre)))
            )
    problem = f"no way was found to where {goal['objectType']} can be seen"
    return Outcome(controller.last_event, False, problem)


def _agent_pose(pose: Mapping[str, float]) -> AgentPose:
    return AgentPose(pose["x"], pose["y"], pose["z"], pose["rotation"], pose["horizon"])


def _interactable_poses(
    controller: Any,
    goal: Mapping[str, Any],
    positions: Sequence[Position],
    rotations: Sequence[float],
    horizons: Sequence[float],
) -> list[dict[str, Any]]:
    event = controller.step(
        action="GetInteractablePoses",
        objectId=goal["objectId"],
        positions=[{axis: position[axis] for axis in "xyz"} for position in positions],
        rotations=list(rotations),
        horizons=list(horizons),
        standings=[True],
        renderImage=False,
    )
    poses: list[dict[str, Any]] = event.metadata["actionReturn"]
    return poses


def _discomfort(pose: Mapping[str, Any], centre: Mapping[str, float]) -> float:
    """How badly a pose is suited to look at a point: 1 for every 45 degrees or metre amiss."""
    dx, dz = centre["x"] - pose["x"], centre["z"] - pose["z"]
    distance = hypot(dx, dz)
    eye = pose["y"] + 0.675
    aside: float = abs((degrees(atan2(dx, dz)) - pose["rotation"] + 180) % 360 - 180)
    below: float = abs(degrees(atan2(eye - centre["y"], max(distance, 0.1))) - pose["horizon"])
    return aside / 45 + below / 45 + abs(distance - _COMFORTABLE)


def observe(controller: Any) -> Outcome:
    """Look right, behind and left, and turn back to where one looked before."""
    views = {}
    for view in _VIEWS:
        views[view] = controller.step(action="RotateRight", degrees=90)
    return Outcome(controller.step(action="RotateRight", degrees=90), True, views=views)


def move_forward(controller: Any, grid_size: float) -> Outcome:
    """Walk ahead, up to :data:`FORWARD_STEP` metres, in steps of the grid while there is room."""
    taken = 0.0
    while taken < FORWARD_STEP - 1e-6:
        step = min(grid_size, FORWARD_STEP - taken)
        event = controller.step(action="MoveAhead", moveMagnitude=step)
        if not event.metadata["lastActionSuccess"]:
            break
        taken += step
    return Outcome(event, taken > 0, "" if taken else event.metadata["errorMessage"])


def _part_to_put_into(entry: Mapping[str, Any], objects: Objects) -> str:
    """The id of the receptacle proper: a Sink's basin rather than the Sink."""
    part = f"{entry['objectId']}|{STANDS_FOR.get(entry['objectType'], '')}"
    return part if part in objects else str(entry["objectId"])


def _put(controller: Any, entry: Mapping[str, Any], objects: Objects) -> Any:
    # forceAction waives which types AI2-THOR thinks belong there: the paper asks for a Cup in the
    # GarbageCan. Room, reach and a closed door still count.
    return controller.step(
        action="PutObject", objectId=_part_to_put_into(entry, objects), forceAction=True
    )


def _toggle(controller: Any, entry: Mapping[str, Any], objects: Objects) -> Any:
    switch = entry
    if entry["objectType"] == "StoveBurner":
        # AI2-THOR's burners have no switch; the knob that names one in controlledObjects is it.
        for other in objects.values():
            if entry["objectId"] in (other["controlledObjects"] or ()):
                switch = other
    action = "ToggleObjectOff" if switch["isToggled"] else "ToggleObjectOn"
    # The agent sees the burner; whether its knob is in the picture is no matter.
    return controller.step(
        action=action, objectId=switch["objectId"], forceAction=switch is not entry
    )


def _simple(action: str) -> Callable[[Any, Mapping[str, Any], Objects], Any]:
    return lambda controller, entry, objects: controller.step(
        action=action, objectId=entry["objectId"]
    )


_INTERACTIONS: dict[str, Callable[[Any, Mapping[str, Any], Objects], Any]] = {
    verbs.PICKUP: _simple("PickupObject"),
    verbs.OPEN: _simple("OpenObject"),
    verbs.CLOSE: _simple("CloseObject"),
    verbs.PUT: _put,
    verbs.TOGGLE: _toggle,
}


def interact(controller: Any, verb: str, entry: Mapping[str, Any], objects: Objects) -> Outcome:
    """Pick up, put into, open, close or toggle an object."""
    return _outcome(_INTERACTIONS[verb](controller, entry, objects))
