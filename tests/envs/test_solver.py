"""What the solver does when a key action cannot be done at once."""

from __future__ import annotations

from typing import Any

from er_gym.envs.actions import Action
from er_gym.envs.solver import Solver
from er_gym.tasks import verbs
from er_gym.tasks.task import KeyAction

MICROWAVE = "Microwave|+00.00|+01.00|+02.00"
OPEN, TOGGLE = (Action(verb, "Microwave") for verb in (verbs.OPEN, verbs.TOGGLE))


def after(action: Action, success: bool) -> dict[str, Any]:
    """What an agent in front of a microwave is told after an action."""
    return {
        "keys_left": (KeyAction(verbs.OPEN, MICROWAVE),),
        "navigable": ("Microwave",),
        "interactable": ("Microwave",),
        "legal": (OPEN, TOGGLE),
        "verb": action.verb,
        "object_type": action.object_type,
        "action_success": success,
    }


def test_what_does_not_open_is_switched_off_first() -> None:
    assert Solver().next(after(OPEN, success=False))[0] == TOGGLE


def test_it_is_opened_while_nothing_has_failed() -> None:
    for action, success in ((OPEN, True), (TOGGLE, True), (Action(verbs.OPEN, "Fridge"), False)):
        assert Solver().next(after(action, success))[0] == OPEN
