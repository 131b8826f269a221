"""The embedded engine, called with typed arguments: no request, no conversion, no event.

A program that needs neither metadata nor pictures of most of its actions saves a third of their
time. The actions are the same functions that the requests of AI2-THOR's client lead to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from er_gym.sim.actions import perform
from er_gym.sim.actions.move import step_ahead, teleport_to
from er_gym.sim.actions.query import on_floor
from er_gym.sim.actions.rotate_look import turn
from er_gym.sim.engine import Engine
from er_gym.sim.errors import CLIENT_ERRORS
from er_gym.sim.space.interactable_poses import interactable_poses
from er_gym.sim.world import World

Result = tuple[bool, str]
"""Whether an action succeeded, and why not, ``""`` if it did."""


class Direct:
    """Calls of an engine.

    Args:
        engine: what is called.
        before: called before each action, so that whoever keeps an event knows that it is old.
    """

    def __init__(self, engine: Engine, before: Callable[[], None]) -> None:
        self._engine, self._before = engine, before

    @property
    def world(self) -> World:
        """The world as it is now; it must not be changed."""
        return self._engine.world

    def teleport(
        self,
        position: tuple[float, float, float],
        rotation: float,
        horizon: float,
        standing: bool,
        force: bool,
    ) -> Result:
        """``TeleportFull``: metres and degrees; ``force`` skips the check for room."""
        x, y, z = position
        there, yaw = (float(x), float(y), float(z)), float(rotation) % 360.0
        return self._do(
            lambda world: teleport_to(
                world, there, yaw, float(horizon), bool(standing), force=force
            )
        )

    def turn_right(self, degrees: float) -> Result:
        """``RotateRight``."""
        return self._do(lambda world: turn(world, degrees))

    def move_ahead(self, metres: float) -> Result:
        """``MoveAhead``."""
        return self._do(lambda world: step_ahead(world, metres))

    def act(self, action: str, **arguments: Any) -> Result:
        """Any action by its AI2-THOR name.

        Raises:
            ValueError: the call is invalid, as the client raises it.
        """
        return self._do(partial(perform, request={"action": action, **arguments}))

    def poses(
        self,
        object_id: str,
        positions: Sequence[Sequence[float]],
        rotations: Sequence[float],
        horizons: Sequence[float],
    ) -> list[list[float]]:
        """``GetInteractablePoses`` of a standing agent: x, y, z, rotation and horizon of each.

        Args:
            positions: x, y and z of where it may stand.
        """
        world = self.world
        places = on_floor(world, np.array(positions, dtype=np.float64).reshape(-1, 3)[:, ::2])
        found = interactable_poses(
            world, world.find(object_id), places, rotations, horizons, (True,)
        )
        poses: list[list[float]] = found[:, :5].tolist()
        return poses

    def _do(self, act: Callable[[World], Any]) -> Result:
        self._before()
        error, code, _ = self._engine.do(act)
        if code in CLIENT_ERRORS:
            raise ValueError(error)
        return not error, error
