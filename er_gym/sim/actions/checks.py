"""Conditions that several actions check. Each failure says what is wrong."""

from __future__ import annotations

from er_gym.sim.actions.registry import quoted
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World

FARTHEST = 1000.0
"""How far from the origin an object may be put along each axis, metres."""


def field_of_view(name: str, degrees: float) -> None:
    """Refuse a vertical field of view outside 0 to 180 degrees."""
    if not 0.0 < degrees < 180.0:
        raise ActionFailed(f"{name} must be set to (0, 180) noninclusive, not {degrees:g}.")


def within(name: str, value: float | None, low: float, high: float) -> None:
    """Refuse an argument that is given and outside its range."""
    if value is not None and not low <= value <= high:
        given = quoted(value) if isinstance(value, int) else f"{value:g}"  # no float is long
        raise ActionFailed(f"{name} must be within {low:g} and {high:g}, not {given}.")


_NOT_SEEN = "NullReferenceException: Target object not found within the specified visibility."
"""AI2-THOR's message, by which programs recognise this refusal."""


def target(world: World, object_id: str | None, force: bool) -> int:
    """The row of the object that an action names. Unless forced, it must be visible.

    Raises:
        ActionFailed: there is no such object, it is inside something closed, or it is not visible.
    """
    i = world.find(object_id)
    if force or visible(world)[i]:
        return i
    if world.hidden[i]:
        shut = next(a for a in world.ancestors(i) if world.is_shut(a))
        why = f"is inside {world.object_ids[shut]}, which is closed"
    else:
        distance = world.settings.visibility_distance
        why = f"is out of view, farther than {distance:g} m, or hidden"
    raise ActionFailed(f"{_NOT_SEEN} {object_id} {why}.")


def require(world: World, i: int, prop: str, what: str) -> None:
    """Refuse an action on an object that lacks a property."""
    if not world.has(i, prop):
        raise ActionFailed(f"{world.object_ids[i]} is not {what}.")
