"""Rotating, tilting the camera, standing and crouching."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.world import World

LOOK_STEP = 30.0
"""Default tilt of LookUp and LookDown, degrees."""
BEYOND_THE_LIMIT = "LookDownCantExceedMin"
"""AI2-THOR's ``errorCode`` if the camera would tilt too far up or down."""
LOOK_LIMITS = (-30.0, 60.0)
"""The camera tilts from 30 degrees up to 60 degrees down."""
LOOK_TOLERANCE = 1e-3
"""Tolerance of these limits, degrees: AI2-THOR itself reports 60.00002."""


def _tilt(
    world: World, action: str, degrees: float, downwards: float, keep_hand: bool = False
) -> None:
    if degrees < 0.0:
        raise ActionFailed(
            f"{action} action requires positive degree value. Invalid value used: {degrees:g}"
        )
    horizon = world.agent.horizon + downwards * (degrees or LOOK_STEP)
    low, high = LOOK_LIMITS
    if not low - LOOK_TOLERANCE <= horizon <= high + LOOK_TOLERANCE:
        limit = (
            f"down beyond {high:g} degrees below"
            if downwards > 0.0
            else f"up beyond {-low:g} degrees above"
        )
        raise ActionFailed(
            f"can't look {limit} the forward horizon; this would tilt the camera to {horizon:g}",
            BEYOND_THE_LIMIT,
        )
    world.place_agent(replace(world.agent, horizon=horizon), keep_hand=keep_hand)


def _turner(sign: float) -> Callable[..., None]:
    def rotate(
        world: World,
        *,
        degrees: float | None = None,
        manualInteract: bool = False,
        forceAction: bool = False,
        speed: float = 1.0,
        waitForFixedUpdate: bool = False,
        returnToStart: bool = True,
        disableRendering: bool = True,
        fixedDeltaTime: float = 0.02,
    ) -> None:
        """Turn by some degrees (default: rotateStepDegrees).

        ``manualInteract`` leaves the hand as it is. All other arguments have no effect: the held
        object collides with nothing here.
        """
        by = world.settings.rotate_step if degrees is None else degrees
        turn(world, sign * by, keep_hand=manualInteract)

    return rotate


def turn(world: World, by: float, *, keep_hand: bool = False) -> None:
    """Turn the agent clockwise by some degrees; the hand comes to rest unless it is kept."""
    turned = replace(world.agent, rotation=(world.agent.rotation + by) % 360.0)
    world.place_agent(turned, keep_hand=keep_hand)


action("RotateRight")(_turner(1.0))  # clockwise
action("RotateLeft")(_turner(-1.0))


@action("LookUp", server_action=True)
def look_up(world: World, *, degrees: float = 0.0, manualInteract: bool = False) -> None:
    """Tilt the camera up by some degrees (0: by :data:`LOOK_STEP`)."""
    _tilt(world, "LookUp", degrees, -1.0, manualInteract)


@action("LookDown", server_action=True)
def look_down(world: World, *, degrees: float = 0.0, manualInteract: bool = False) -> None:
    """Tilt the camera down, as ``LookUp`` does up."""
    _tilt(world, "LookDown", degrees, 1.0, manualInteract)


@action("RotateLook", server_action=True)
def rotate_look(world: World, *, rotation: Vector | None = None, horizon: float = 0.0) -> None:
    """Turn to a heading and tilt the camera to an angle; both are 0 if not given."""
    if abs(horizon) > 90.0:
        raise ActionFailed(f"horizon must be within -90 and 90 degrees, not {horizon:g}.")
    yaw = 0.0 if rotation is None else rotation.y % 360.0
    world.place_agent(replace(world.agent, rotation=yaw, horizon=horizon), keep_hand=True)


@action("Stand")
def stand(world: World) -> None:
    """Stand up."""
    if world.agent.standing:
        raise ActionFailed("The agent is standing already.")
    world.place_agent(replace(world.agent, standing=True), keep_hand=True)


@action("Crouch")
def crouch(world: World) -> None:
    """Crouch: the camera goes down to the height of the agent's centre."""
    if not world.agent.standing:
        raise ActionFailed("The agent is crouching already.")
    world.place_agent(replace(world.agent, standing=False), keep_hand=True)
