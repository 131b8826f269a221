"""Moving and turning the hand with what it holds (``MoveHeldObject``, ``RotateHeldObject``).

As in AI2-THOR, moving, turning or looking puts the hand to rest, unless ``manualInteract`` is set.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import FARTHEST, within
from er_gym.sim.actions.pick_place import fall
from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.carrying import (
    Hand,
    camera_rotation,
    hand_point,
    hand_rotation,
    in_camera_frame,
    tilt,
    turning,
)
from er_gym.sim.errors import ActionFailed
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.space.clearance import Clearance
from er_gym.sim.space.frustum import in_frustum
from er_gym.sim.space.solids.sample_points import sample_points
from er_gym.sim.world import World

_SPILLS, _EMPTIES = 90.0, 95.0
"""How far the hand leans, degrees, when a liquid pours out and when contents fall out; AI2-THOR's
values."""
_DIRECTIONS = {
    "Ahead": (0.0, 0.0, 1.0),
    "Back": (0.0, 0.0, -1.0),
    "Left": (-1.0, 0.0, 0.0),
    "Right": (1.0, 0.0, 0.0),
    "Up": (0.0, 1.0, 0.0),
    "Down": (0.0, -1.0, 0.0),
}
"""The directions of the camera: right, up and ahead."""


def _held(world: World, else_say: str) -> int:
    if world.held < 0:
        raise ActionFailed(else_say)
    return world.held


def _move(world: World, offset: np.ndarray) -> None:
    """Move the hand by (3,) metres in the world's frame."""
    i = _held(world, "Agent can only move hand if currently holding an item")
    within("The distance", float(np.abs(offset).max()), 0.0, FARTHEST)
    agent, settings = world.agent, world.settings
    target = hand_point(agent, world.hand) + offset
    away = target - agent.camera
    if np.hypot(away[0], away[2]) > settings.visibility_distance:
        raise ActionFailed(
            "The target position is out of range- object cannot move outside of max visibility "
            f"distance, {settings.visibility_distance:g} m."
        )
    points = sample_points(world, i) + offset - agent.camera
    aspect = settings.width / settings.height
    if not in_frustum(points, agent.rotation, agent.horizon, settings.field_of_view, aspect).any():
        raise ActionFailed(
            "Target position is outside of the agent's viewport. The target position must be "
            "within the frustrum of the viewport."
        )
    obstacle = Clearance(world, i).on_the_way(offset)
    if obstacle is not None:
        raise ActionFailed(
            f"{obstacle} is in Object In Hand's Path! Can't Move Hand holding {world.names[i]}"
        )
    hand = world.hand or Hand()
    x, y, z = (hand.shift + camera_rotation(agent).T @ offset).tolist()
    world.pose_hand(replace(hand, shift=(x, y, z)))
    world.state_changed()


@action("MoveHeldObject")
def move_held_object(
    world: World,
    *,
    right: float = 0.0,
    up: float = 0.0,
    ahead: float = 0.0,
    forceVisible: bool = False,
) -> None:
    """Move what the hand holds by metres along the camera's axes.

    It stays within the visibility distance, in the picture, and clear of other objects.
    ``forceVisible`` has no effect: nothing hides what the hand holds.
    """
    _move(world, camera_rotation(world.agent) @ np.array([right, up, ahead]))


@action("MoveHandDelta")
def move_hand_delta(
    world: World, *, x: float, y: float, z: float, forceVisible: bool = False
) -> None:
    """The old name of MoveHeldObject, with its own names of arguments."""
    move_held_object(world, right=x, up=y, ahead=z)


def _mover(direction: tuple[float, float, float]) -> Callable[..., None]:
    def move(world: World, *, moveMagnitude: float, forceVisible: bool = False) -> None:
        right, up, ahead = (part * moveMagnitude for part in direction)
        move_held_object(world, right=right, up=up, ahead=ahead)

    return move


for _name, _direction in _DIRECTIONS.items():
    action(f"MoveHeldObject{_name}", f"MoveHand{_name}")(_mover(_direction))


@action("MoveHandMagnitude")
def move_hand_magnitude(
    world: World, *, moveMagnitude: float, x: float = 0.0, y: float = 0.0, z: float = 0.0
) -> None:
    """Move what the hand holds by metres along those axes of the camera that are not 0."""
    right, up, ahead = (float(np.sign(part)) * moveMagnitude for part in (x, y, z))
    move_held_object(world, right=right, up=up, ahead=ahead)


@action("MoveHand", "MoveHandForce")
def move_hand(world: World, *, x: float, y: float, z: float) -> None:
    """Move what the hand holds by metres along the agent's axes: up is up."""
    turn = unity_rotation(np.array([0.0, world.agent.rotation, 0.0]))
    _move(world, turn @ np.array([x, y, z]))


def _turn(world: World, rotation: np.ndarray, collides: str) -> None:
    """Turn the hand, with what it holds, to a (3, 3) rotation of the world."""
    i, before = world.held, world.hand
    rows, clearance = world.in_hand, Clearance(world, world.held)
    arrays = (world.position, world.rotation, world.low, world.high)
    were = [array[rows].copy() for array in arrays]
    turn = in_camera_frame(world.agent, rotation)
    world.pose_hand(turning(world, world.agent, before, turn))
    obstacle = clearance.met_by(world.low[i], world.high[i])
    if obstacle is not None:
        for array, was in zip(arrays, were, strict=True):
            array[rows] = was
        world.hand = before
        world.move_by(i, np.zeros(3))
        raise ActionFailed(f"{collides} {obstacle} is in the way.")
    pour(world)


def pour(world: World) -> None:
    """Pour the liquid out of what the hand holds, if it leans too far."""
    if tilt(world.agent, world.hand) <= _SPILLS:
        return
    for i in world.in_hand:
        if world.state(i, "isFilledWithLiquid"):
            world.fill_liquid[i] = None
            world.set_state(i, "isFilledWithLiquid", False)
    consequences.apply(world)


@action("RotateHeldObject")
def rotate_held_object(world: World, *, rotation: Vector) -> None:
    """Turn what the hand holds to a rotation in the camera's frame, degrees.

    A liquid pours out beyond 90 degrees from upright, and contents fall out beyond 95.
    """
    i = _held(world, "Can't rotate held object since no object is being held.")
    local = unity_rotation(np.array([rotation.x, rotation.y, rotation.z]))
    _turn(
        world,
        camera_rotation(world.agent) @ local,
        "Object is unable to rotate in its current state!",
    )
    if tilt(world.agent, world.hand) > _EMPTIES:
        for child in list(world.contents[i]):
            if world.has(child, "pickupable"):
                fall(world, child, (world.low[child] + world.high[child]) / 2)


@action("RotateHeldObject")
def rotate_held_object_by(
    world: World, *, pitch: float = 0.0, yaw: float = 0.0, roll: float = 0.0
) -> None:
    """Turn what the hand holds by degrees: forward, clockwise from above, and to the right.

    A liquid pours out beyond 90 degrees from upright. As in AI2-THOR, contents stay.
    """
    _held(world, "Can't rotate held object since no object is being held.")
    heading = unity_rotation(np.array([0.0, world.agent.rotation, 0.0]))
    by = unity_rotation(np.array([pitch, yaw, -roll]))
    own = heading.T @ hand_rotation(world.agent, world.hand)
    _turn(world, heading @ by @ own, "Held object is coliding after rotation.")


@action("RotateHand")
def rotate_hand(world: World, *, x: float, y: float, z: float) -> None:
    """The old name of RotateHeldObject with a rotation."""
    rotate_held_object(world, rotation=Vector(x=x, y=y, z=z))


@action("RotateHandRelative")
def rotate_hand_relative(world: World, *, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> None:
    """The old name of RotateHeldObject by angles; ``z`` turns to the left."""
    rotate_held_object_by(world, pitch=x, yaw=y, roll=-z)
