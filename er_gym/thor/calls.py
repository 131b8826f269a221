"""The calls of AI2-THOR that the environment makes at nearly every step, on either engine.

On the embedded engine they go to the engine itself while nothing is drawn. Otherwise each is a
request of the controller, as any program makes it, and its event is read.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from er_gym.thor.objects import ObjectTable, objects_in, objects_of

Result = tuple[bool, str]
"""Whether an action succeeded, and AI2-THOR's error message."""
Position = tuple[float, float, float]


class Seen(NamedTuple):
    """What AI2-THOR tells after an action.

    Attributes:
        objects: the N objects of the scene.
        visible, interactable: (N,) bool.
        position: the agent's, metres.
        rotation, horizon: degrees.
        standing: False while it crouches.
        event: for the images; None if nothing is drawn.
    """

    objects: ObjectTable
    visible: NDArray[np.bool_]
    interactable: NDArray[np.bool_]
    position: Position
    rotation: float
    horizon: float
    standing: bool
    event: Any


class Calls(Protocol):
    """The calls; each changes the world, or tells how it is."""

    def teleport(
        self, position: Position, rotation: float, horizon: float, standing: bool, force: bool
    ) -> Result:
        """``TeleportFull``: metres and degrees; ``force`` skips AI2-THOR's check for room."""

    def turn_right(self, degrees: float) -> Result:
        """``RotateRight``."""

    def move_ahead(self, metres: float) -> Result:
        """``MoveAhead``; nothing is drawn."""

    def act(self, action: str, **arguments: Any) -> Result:
        """Any action by its AI2-THOR name."""

    def poses(
        self,
        object_id: str,
        positions: Sequence[Sequence[float]],
        rotations: Sequence[float],
        horizons: Sequence[float],
    ) -> list[list[float]]:
        """``GetInteractablePoses`` of a standing agent: x, y, z, rotation and horizon of each."""

    def seen(self) -> Seen:
        """What the last action led to; drawn now if it has not been, and there are pictures."""


def calls_of(controller: Any) -> Calls:
    """The quickest way to call the engine of a controller."""
    direct = getattr(controller, "direct", None)
    return _RequestCalls(controller) if direct is None else _DirectCalls(direct)


class _DirectCalls:
    """Typed calls of the embedded engine."""

    def __init__(self, direct: Any) -> None:
        self._direct = direct
        self.teleport, self.turn_right = direct.teleport, direct.turn_right
        self.move_ahead, self.act, self.poses = direct.move_ahead, direct.act, direct.poses

    def seen(self) -> Seen:
        world = self._direct.world
        agent = world.agent
        return Seen(
            *objects_in(world),
            tuple(agent.position.tolist()),
            float(agent.rotation),
            float(agent.horizon),
            agent.standing,
            None,
        )


class _RequestCalls:
    """Requests of a controller."""

    def __init__(self, controller: Any) -> None:
        self._controller, self._drawn = controller, True

    def teleport(
        self, position: Position, rotation: float, horizon: float, standing: bool, force: bool
    ) -> Result:
        return self.act(
            "TeleportFull",
            position=dict(zip("xyz", position, strict=True)),
            rotation={"x": 0.0, "y": rotation, "z": 0.0},
            horizon=horizon,
            standing=standing,
            forceAction=force,
        )

    def turn_right(self, degrees: float) -> Result:
        return self.act("RotateRight", degrees=degrees)

    def move_ahead(self, metres: float) -> Result:
        result = self.act("MoveAhead", moveMagnitude=metres, renderImage=False)
        self._drawn = False
        return result

    def act(self, action: str, **arguments: Any) -> Result:
        self._drawn = True
        metadata = self._controller.step(action=action, **arguments).metadata
        return metadata["lastActionSuccess"], metadata["errorMessage"]

    def poses(
        self,
        object_id: str,
        positions: Sequence[Sequence[float]],
        rotations: Sequence[float],
        horizons: Sequence[float],
    ) -> list[list[float]]:
        event = self._controller.step(
            action="GetInteractablePoses",
            objectId=object_id,
            positions=[{"x": x, "y": y, "z": z} for x, y, z in positions],
            rotations=list(rotations),
            horizons=list(horizons),
            standings=[True],
            renderImage=False,
        )
        return [
            [pose[name] for name in ("x", "y", "z", "rotation", "horizon")]
            for pose in event.metadata["actionReturn"]
        ]

    def seen(self) -> Seen:
        if not self._drawn and not self._controller.headless:
            self._controller.step(action="Pass")  # to draw the one picture needed
        return seen_in(self._controller.last_event)


def seen_in(event: Any) -> Seen:
    """What an event of AI2-THOR tells."""
    objects, visible, interactable = objects_of(event)
    agent = event.metadata["agent"]
    position = agent["position"]
    return Seen(
        objects,
        visible,
        interactable,
        (position["x"], position["y"], position["z"]),
        agent["rotation"]["y"],
        agent["cameraHorizon"],
        agent["isStanding"],
        event,
    )
