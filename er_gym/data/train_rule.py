"""The rule of flags: which turns of a trajectory are learnt follows from the rest of it.

As in the paper's third stage (arXiv 2503.21696), nothing is learnt up to the first fault or mistake
of a trajectory, that turn included, and nothing of the beginning that a correction repeats. Where a
model decided, a turn whose action failed is not learnt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from er_gym.data.trajectory import Trajectory, Turn

REPEAT = "repeat"
"""The purpose of a mistake on purpose."""
QUOTING = ("model", "played")
"""Kinds of trajectories with a model's own decisions and words."""


def repeats_own_words(trajectory: Trajectory, index: int) -> bool:
    """Whether a turn repeats an episode that failed, and has the thoughts of the agent there."""
    said = trajectory.correction
    return said is not None and bool(said.agent) and index <= said.first_wrong


def own_voice(trajectory: Trajectory, index: int) -> str:
    """Who decided a turn and may have thought so itself; ``""`` if thoughts are written for it."""
    if trajectory.correction is not None and repeats_own_words(trajectory, index):
        return trajectory.correction.agent
    return trajectory.actor if trajectory.kind in QUOTING else ""


def _after_the_beginning(trajectory: Trajectory, index: int, turn: Turn) -> bool:
    said = trajectory.correction
    return said is None or index > said.first_wrong


def _where_it_worked(trajectory: Trajectory, index: int, turn: Turn) -> bool:
    return turn.success


def _unless_on_purpose(trajectory: Trajectory, index: int, turn: Turn) -> bool:
    return turn.purpose != REPEAT


_RULES: Mapping[str, Callable[[Trajectory, int, Turn], bool]] = {
    "corrected": _after_the_beginning,
    **dict.fromkeys(QUOTING, _where_it_worked),
}
"""By kind of trajectory; for all others :func:`_unless_on_purpose`."""


def learnt(trajectory: Trajectory) -> list[bool]:
    """For each turn, whether it is to be learnt: what ``train`` must be."""
    rule = _RULES.get(trajectory.kind, _unless_on_purpose)
    turns = trajectory.turns
    odd = (index for index, one in enumerate(turns) if one.fault or one.purpose == REPEAT)
    first_odd = next(odd, -1)
    return [index > first_odd and rule(trajectory, index, turn) for index, turn in enumerate(turns)]
