"""The agent's lens, and cameras that stand in the room."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

from er_gym.sim.actions.checks import FARTHEST, FIELDS_OF_VIEW, within
from er_gym.sim.actions.registry import Vector, action
from er_gym.sim.errors import INVALID_ARGUMENT, ActionFailed
from er_gym.sim.world import ThirdPartyCamera, World

_AntiAliasing = Literal["none", "fxaa", "smaa", "taa"]


class PartialVector(BaseModel):
    """A point or a direction of which only some coordinates are given."""

    model_config = ConfigDict(allow_inf_nan=False)

    x: float | None = None
    y: float | None = None
    z: float | None = None


@action("ChangeFOV")
def change_fov(world: World, *, fieldOfView: float) -> None:
    """Give the agent's camera another vertical field of view, in degrees."""
    within("fieldOfView", fieldOfView, *FIELDS_OF_VIEW)
    world.configure(field_of_view=fieldOfView)


@action("AddThirdPartyCamera")
def add_third_party_camera(
    world: World,
    *,
    position: Vector,
    rotation: Vector,
    fieldOfView: float = 90.0,
    orthographic: bool = False,
    skyboxColor: str | None = None,
    antiAliasing: _AntiAliasing = "none",
) -> None:
    """Set up another camera, at a point in metres and a rotation in degrees.

    ``skyboxColor`` and ``antiAliasing`` are accepted and change nothing: the room is drawn around
    every camera, so that no sky is seen, and edges are drawn as they are.
    """
    _no_orthographic(orthographic)
    _no_farther(position, rotation)
    within("fieldOfView", fieldOfView, *FIELDS_OF_VIEW)
    camera = ThirdPartyCamera(
        (position.x, position.y, position.z), (rotation.x, rotation.y, rotation.z), fieldOfView
    )
    world.cameras = (*world.cameras, camera)


@action("UpdateThirdPartyCamera")
def update_third_party_camera(
    world: World,
    *,
    thirdPartyCameraId: int = 0,
    position: PartialVector | None = None,
    rotation: PartialVector | None = None,
    fieldOfView: float | None = None,
    orthographic: bool = False,
    skyboxColor: str | None = None,
) -> None:
    """Move, turn or zoom a third-party camera; what is not given stays as it is."""
    _no_orthographic(orthographic)
    _no_farther(position, rotation)
    within("fieldOfView", fieldOfView, *FIELDS_OF_VIEW)
    count = len(world.cameras)
    if not 0 <= thirdPartyCameraId < count:
        there = f"of 0 to {count - 1}" if count else "yet: AddThirdPartyCamera makes one"
        raise ActionFailed(
            f"There is no third-party camera {thirdPartyCameraId} {there}.", INVALID_ARGUMENT
        )
    old = world.cameras[thirdPartyCameraId]
    cameras = list(world.cameras)
    cameras[thirdPartyCameraId] = ThirdPartyCamera(
        _updated(old.position, position),
        _updated(old.rotation, rotation),
        old.field_of_view if fieldOfView is None else fieldOfView,
    )
    world.cameras = tuple(cameras)


def _updated(
    old: tuple[float, float, float], new: PartialVector | None
) -> tuple[float, float, float]:
    if new is None:
        return old
    x, y, z = old
    return (
        x if new.x is None else new.x,
        y if new.y is None else new.y,
        z if new.z is None else new.z,
    )


def _no_orthographic(orthographic: bool) -> None:
    if orthographic:
        raise ActionFailed(
            "The embedded engine draws in perspective only, not orthographic=True; "
            "backend='unity' has both.",
            INVALID_ARGUMENT,
        )


def _no_farther(*vectors: Vector | PartialVector | None) -> None:
    for vector in vectors:
        if vector is not None:
            for axis in "xyz":
                within(axis, getattr(vector, axis), -FARTHEST, FARTHEST)
