"""The agent's field of view, and third-party cameras."""

from __future__ import annotations

from er_gym.sim.actions.checks import FARTHEST, field_of_view, within
from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import PartialVector, Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.settings import ThirdPartyCamera
from er_gym.sim.space.map_camera import map_camera
from er_gym.sim.world import World

_UNITYS_SIZE = 5.0
"""Unity's ``orthographicSize`` where none is given, metres."""


@action("ChangeFOV")
def change_fov(world: World, *, fieldOfView: float) -> None:
    """Set the vertical field of view of the agent's camera, degrees."""
    field_of_view("fov", fieldOfView)
    world.configure(field_of_view=fieldOfView)


@action("AddThirdPartyCamera")
def add_third_party_camera(
    world: World,
    *,
    position: Vector,
    rotation: Vector,
    fieldOfView: float = 90.0,
    skyboxColor: str | None = None,
    orthographic: bool = False,
    orthographicSize: float | None = None,
    nearClippingPlane: float | None = None,
    farClippingPlane: float | None = None,
    antiAliasing: str = "none",
) -> None:
    """Add a third-party camera at a point in metres, with a rotation in degrees.

    An orthographic camera sees twice ``orthographicSize`` metres from bottom to top.
    ``skyboxColor``, ``antiAliasing`` and the clipping planes have no effect. The room surrounds
    every camera, so no sky is seen, and edges are not smoothed.
    """
    size = _orthographic_size(orthographic, orthographicSize, _UNITYS_SIZE)
    _no_farther(position, rotation)
    field_of_view("fieldOfView", fieldOfView)
    camera = ThirdPartyCamera(
        (position.x, position.y, position.z),
        (rotation.x, rotation.y, rotation.z),
        fieldOfView,
        size,
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
    skyboxColor: str | None = None,
    orthographic: bool | None = None,
    orthographicSize: float | None = None,
    nearClippingPlane: float | None = None,
    farClippingPlane: float | None = None,
) -> None:
    """Move, turn or zoom a third-party camera. Arguments that are left out keep their values."""
    _no_farther(position, rotation)
    if fieldOfView is not None:
        field_of_view("fieldOfView", fieldOfView)
    count = len(world.cameras)
    if not 0 <= thirdPartyCameraId < count:
        there = f"of 0 to {count - 1}" if count else "yet: AddThirdPartyCamera makes one"
        raise ActionFailed(f"There is no third-party camera {thirdPartyCameraId} {there}.")
    old = world.cameras[thirdPartyCameraId]
    was = old.orthographic_size
    size = _orthographic_size(
        was is not None if orthographic is None else orthographic,
        orthographicSize,
        _UNITYS_SIZE if was is None else was,
    )
    cameras = list(world.cameras)
    cameras[thirdPartyCameraId] = ThirdPartyCamera(
        _updated(old.position, position),
        _updated(old.rotation, rotation),
        old.field_of_view if fieldOfView is None else fieldOfView,
        size,
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


@action("GetMapViewCameraProperties")
def get_map_view_camera_properties(world: World) -> dict[str, object]:
    """The camera that sees the whole room from above: arguments of AddThirdPartyCamera."""
    camera = map_camera(world.scene.name)
    return {
        "position": dict(zip("xyz", camera.position, strict=True)),
        "rotation": dict(zip("xyz", camera.rotation, strict=True)),
        "orthographicSize": camera.orthographic_size,
        "orthographic": True,
    }


@action("ToggleMapView")
def toggle_map_view(world: World) -> None:
    """Let the agent's picture show the room from above, or what the agent sees again.

    What is visible to the agent stays the same.
    """
    world.map_view = not world.map_view


def _orthographic_size(orthographic: bool, given: float | None, otherwise: float) -> float | None:
    """Half of what a camera sees from bottom to top, metres; None for a camera in perspective."""
    if not orthographic:
        if given is not None:
            raise ActionFailed(
                f"orthographicSize ({given:g}) can only be set when orthographic=True."
            )
        return None
    size = otherwise if given is None else given
    if not 0.0 < size <= FARTHEST:
        raise ActionFailed(
            f"orthographicSize must be above 0 and at most {FARTHEST:g} meters, not {size:g}."
        )
    return size


def _no_farther(*vectors: Vector | PartialVector | None) -> None:
    for vector in vectors:
        if vector is not None:
            for axis in "xyz":
                within(axis, getattr(vector, axis), -FARTHEST, FARTHEST)
