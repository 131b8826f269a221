"""What the turns of a trajectory must be by the rest of it, derived anew and compared."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from er_gym.data.comparing import compared
from er_gym.data.train_rule import QUOTING, learnt, own_voice
from er_gym.data.trajectory import Purpose, Trajectory, Turn
from er_gym.rollout.records import ERROR
from er_gym.tasks import verbs

MOST_THOUGHTS = 4
"""A turn has no more thoughts than this, where they were drawn."""
_PURPOSES: Mapping[Purpose, tuple[str, ...]] = {
    "search": (verbs.NAVIGATE,),
    "approach": (verbs.NAVIGATE,),
    "carry": (verbs.NAVIGATE,),
    "look around": (verbs.OBSERVE,),
    "get closer": (verbs.NAVIGATE, verbs.MOVE_FORWARD),
    "open to look": (verbs.OPEN,),
    "open to put": (verbs.OPEN,),
    "close again": (verbs.CLOSE,),
    "take": (verbs.PICKUP,),
    "put": (verbs.PUT,),
    "put down": (verbs.PUT,),
    "switch": (verbs.TOGGLE,),
    "check": (verbs.MOVE_FORWARD,),
    "finish": (verbs.END,),
}
"""The verbs of the actions that are taken for a purpose; a purpose that is not here fits any."""
_WITH_FULL_HAND = frozenset({"carry", "open to put", "put down"})
"""Purposes of an agent that holds something. An agent may try to ``put`` what it does not hold."""
_AGAIN = frozenset({"retry", "repeat"})
"""Purposes of the same action as before."""

Check: TypeAlias = Callable[[Trajectory, int], Iterator[str]]


def turn_problems(trajectory: Trajectory) -> Iterator[str]:
    """The fields of the turns that do not fit the rest of the trajectory."""
    yield from _places(trajectory.turns)
    for index, (turn, train) in enumerate(zip(trajectory.turns, learnt(trajectory), strict=True)):
        for line in compared("train", turn.train, train, "the rule of flags"):
            yield f"turn {index}: {line}"
        for check in CHECKS:
            yield from (f"turn {index}: {line}" for line in check(trajectory, index))


def _places(turns: Sequence[Turn]) -> Iterator[str]:
    at = ""
    for index, turn in enumerate(turns):
        for line in compared("at", turn.at, at, "the actions before"):
            yield f"turn {index}: {line}"
        if turn.verb == verbs.NAVIGATE and turn.success:
            at = turn.object_type


def _purpose(trajectory: Trajectory, index: int) -> Iterator[str]:
    turn = trajectory.turns[index]
    fitting = _PURPOSES.get(turn.purpose, (turn.verb,))
    if turn.verb not in (*fitting, ERROR):
        yield f"purpose is {turn.purpose!r}, which is none of {turn.verb!r}"
    if turn.purpose in _WITH_FULL_HAND and not turn.held and trajectory.kind not in QUOTING:
        yield f"purpose is {turn.purpose!r}, but the hand is empty"
    before = trajectory.turns[index - 1].action if index else None
    if turn.purpose in _AGAIN and turn.action != before:
        yield f"purpose is {turn.purpose!r}, but the action before was {before}"


def _plan(trajectory: Trajectory, index: int) -> Iterator[str]:
    turn = trajectory.turns[index]
    if turn.plan and (turn.verb != verbs.NAVIGATE or turn.plan[0] != turn.object_type):
        yield f"plan is {turn.plan!r:.120}, which does not begin with {str(turn.action)!r}"


def _thoughts(trajectory: Trajectory, index: int) -> Iterator[str]:
    kinds = [each.kind for each in trajectory.turns[index].thoughts]
    if own_voice(trajectory, index):
        return
    if not 0 < len(kinds) <= MOST_THOUGHTS or len({*kinds}) < len(kinds):
        yield (
            f"thoughts are of the kinds {kinds!r}; there are one to {MOST_THOUGHTS}, each of "
            "another kind"
        )


CHECKS: tuple[Check, ...] = (_purpose, _plan, _thoughts)
