"""Conditions that several actions share; each says what is wrong."""

from __future__ import annotations

from er_gym.sim.actions.registry import quoted
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World

FIELDS_OF_VIEW = (1.0, 179.0)
"""The smallest and the largest vertical field of view that is drawn, degrees."""

FARTHEST = 1000.0
"""How far from the origin anything may be put along each axis, metres."""


def field_of_view(name: str, degrees: float) -> None:
    """Refuse a vertical field of view that no camera has."""
    if not 0.0 < degrees < 180.0:
        raise ActionFailed(f"{name} must be set to (0, 180) noninclusive, not {degrees:g}.")
    within(name, degrees, *FIELDS_OF_VIEW)


def within(name: str, value: float | None, low: float, high: float) -> None:
    """Refuse an argument that is given and out of its range."""
    if value is not None and not low <= value <= high:
        given = quoted(value) if isinstance(value, int) else f"{value:g}"  # no float is that long
        raise ActionFailed(f"{name} must be within {low:g} and {high:g}, not {given}.")


def target(world: World, object_id: str, force: bool) -> int:
    """The object that an action names; unless forced it has to be in view and within reach.

    Raises:
        ActionFailed: there is no such object, it is shut away, or it cannot be seen from here.
    """
    i = world.find(object_id)
    if force:
        return i
    if world.hidden[i]:
        shut = next(a for a in world.ancestors(i) if world.is_shut(a))
        raise ActionFailed(f"{object_id} is inside {world.object_ids[shut]}, which is closed.")
    if not visible(world)[i]:
        raise ActionFailed(
            f"{object_id} is not visible from here: it is out of view, farther than "
            f"{world.settings.visibility_distance:g} m, or hidden."
        )
    return i


def require(world: World, i: int, prop: str, what: str) -> None:
    """Refuse an action on an object that lacks a property."""
    if not world.has(i, prop):
        raise ActionFailed(f"{world.object_ids[i]} is not {what}.")
