"""Turning, tilting the camera, standing and crouching."""

from __future__ import annotations

from dataclasses import replace

from er_gym.sim.actions.registry import action
from er_gym.sim.errors import ActionFailed
from er_gym.sim.world import World

LOOK_STEP = 30.0
"""Default tilt of LookUp and LookDown, degrees."""
LOOK_LIMITS = (-30.0, 60.0)
"""The camera tilts from 30 degrees up to 60 degrees down."""
_TOLERANCE = 1e-3


def _turn(world: World, degrees: float) -> None:
    world.place_agent(replace(world.agent, rotation=(world.agent.rotation + degrees) % 360.0))


def _tilt(world: World, degrees: float) -> None:
    horizon = world.agent.horizon + degrees
    low, high = LOOK_LIMITS
    if not low - _TOLERANCE <= horizon <= high + _TOLERANCE:
        raise ActionFailed(
            f"The camera tilts from {low:g} (up) to {high:g} degrees (down); "
            f"this would tilt it to {horizon:g}."
        )
    world.place_agent(replace(world.agent, horizon=horizon))


@action("RotateRight")
def rotate_right(world: World, *, degrees: float | None = None) -> None:
    """Turn clockwise by some degrees (default: rotateStepDegrees)."""
    _turn(world, world.settings.rotate_step if degrees is None else degrees)


@action("RotateLeft")
def rotate_left(world: World, *, degrees: float | None = None) -> None:
    """Turn anticlockwise."""
    _turn(world, -(world.settings.rotate_step if degrees is None else degrees))


@action("LookUp")
def look_up(world: World, *, degrees: float = LOOK_STEP) -> None:
    """Tilt the camera up."""
    _tilt(world, -degrees)


@action("LookDown")
def look_down(world: World, *, degrees: float = LOOK_STEP) -> None:
    """Tilt the camera down."""
    _tilt(world, degrees)


@action("Stand")
def stand(world: World) -> None:
    """Stand up."""
    if world.agent.standing:
        raise ActionFailed("The agent is standing already.")
    world.place_agent(replace(world.agent, standing=True))


@action("Crouch")
def crouch(world: World) -> None:
    """Crouch: the camera goes down to the height of the agent's centre."""
    if not world.agent.standing:
        raise ActionFailed("The agent is crouching already.")
    world.place_agent(replace(world.agent, standing=False))
