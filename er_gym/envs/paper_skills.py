"""The paper's skills, turned into calls of the AI2-THOR controller.

An action has succeeded when AI2-THOR reports no error after the last of its calls; after a walk or
a look round that last call is a turn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot
from typing import Any

from er_gym.envs.paper_approach import ObjectSnapshot, step_undrawn, teleport
from er_gym.envs.perception import Perception, perceive
from er_gym.envs.skills import FORWARD_STEP, VIEWS, Outcome
from er_gym.tasks import verbs
from er_gym.tasks.task import AgentPose

_LEFT, _RIGHT = "Left", "Right"


def outcome_after(controller: Any) -> Outcome:
    """The outcome of a skill after its calls: the perception, and the error of the last call."""
    error = controller.last_event.metadata["errorMessage"]
    if not controller.headless:
        controller.step(action="Pass")  # to draw the one picture needed
    return Outcome(perceive(controller.last_event), not error, error=error)


def start_again(controller: Any, start: AgentPose) -> Outcome:
    """Go back to where the episode began."""
    teleport(controller, start)
    return outcome_after(controller)


def observe(controller: Any) -> Outcome:
    """Look left, behind and right, and turn back.

    The views are returned in the order of :data:`er_gym.envs.skills.VIEWS`.
    """

    def turned() -> Perception:
        return perceive(controller.step(action="RotateLeft", degrees=90))

    left, behind, right, last = turned(), turned(), turned(), turned()
    error = controller.last_event.metadata["errorMessage"]
    views = dict(zip(VIEWS, (right, behind, left), strict=True))
    return Outcome(last, not error, views=views, error=error)


def _call(verb_to_action: str, **fixed: Any) -> Callable[[Any, ObjectSnapshot], Any]:
    return lambda controller, target: controller.step(
        action=verb_to_action, objectId=target.object_id, forceAction=False, **fixed
    )


_TOGGLE = {False: _call("ToggleObjectOn"), True: _call("ToggleObjectOff")}
_INTERACTIONS: dict[str, Callable[[Any, ObjectSnapshot], Any]] = {
    verbs.PICKUP: _call("PickupObject", manualInteract=False),
    verbs.PUT: _call("PutObject", placeStationary=True),
    verbs.OPEN: _call("OpenObject", openness=1),
    verbs.CLOSE: _call("CloseObject"),
    verbs.TOGGLE: lambda controller, target: _TOGGLE[target.is_toggled](controller, target),
}


def interact(controller: Any, verb: str, target: ObjectSnapshot) -> Outcome:
    """Pick up, put into, open, close or toggle an object, as far as AI2-THOR allows."""
    event = _INTERACTIONS[verb](controller, target)
    error = event.metadata["errorMessage"]
    return Outcome(perceive(event), not error, error=error)


# -- move forward ----------------------------------------------------------------------------------


def move_forward(controller: Any, related: Sequence[str]) -> Outcome:
    """Walk half a metre ahead; if that is blocked, to a side; if that is blocked, too, back.

    A side step is a turn, a step ahead and a turn back. The paper counts it as done when the turn
    back succeeds, even if the step itself is blocked.

    Args:
        related: ids of the task's related objects. If both sides are free, the agent takes the side
            that brings it nearest to a related object that it sees.
    """
    if not _walk(controller, "MoveAhead"):
        _go_round(controller, related)
    return outcome_after(controller)


def _go_round(controller: Any, related: Sequence[str]) -> None:
    if not related:
        if not (_side_step(controller, _RIGHT) or _side_step(controller, _LEFT)):
            _back_off(controller)
        return
    right, at_right = _tried(controller, _RIGHT, _LEFT)
    left, at_left = _tried(controller, _LEFT, _RIGHT)
    goals = [
        (entry["position"]["x"], entry["position"]["z"])
        for entry in controller.last_event.metadata["objects"]
        if entry["objectId"] in related and entry["visible"]
    ]
    if right and left and goals:
        nearer = _nearest(at_right, goals) < _nearest(at_left, goals)
        _side_step(controller, _RIGHT if nearer else _LEFT)
    elif right or left:
        _side_step(controller, _RIGHT if right else _LEFT)
    else:
        _back_off(controller)


def _tried(controller: Any, side: str, other: str) -> tuple[bool, tuple[float, float]]:
    """Step to a side and back again; return whether that succeeded, and the (x, z) of the side.

    If the step aside was blocked, the step back leads elsewhere, as in the paper's program.
    """
    went = _side_step(controller, side)
    position = controller.last_event.metadata["agent"]["position"]
    if went:
        _side_step(controller, other)
    return went, (position["x"], position["z"])


def _nearest(place: tuple[float, float], goals: Sequence[tuple[float, float]]) -> float:
    return min(hypot(place[0] - x, place[1] - z) for x, z in goals)


def _side_step(controller: Any, side: str) -> bool:
    step_undrawn(controller, f"Rotate{side}", degrees=90)
    _walk(controller, "MoveAhead")
    return step_undrawn(controller, f"Rotate{_LEFT if side == _RIGHT else _RIGHT}", degrees=90)


def _back_off(controller: Any) -> None:
    """Walk back; if that is blocked, too, turn right and walk; if that is blocked, turn left and
    walk."""
    if _walk(controller, "MoveBack"):
        return
    turned = step_undrawn(controller, "RotateRight", degrees=90)
    if not _walk(controller, "MoveAhead"):
        if turned:
            step_undrawn(controller, "RotateLeft", degrees=180)
        _walk(controller, "MoveAhead")


def _walk(controller: Any, action: str) -> bool:
    return step_undrawn(controller, action, moveMagnitude=FORWARD_STEP)
