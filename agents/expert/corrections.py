"""The beginnings of failed episodes that are corrected, each up to a wrong action."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random
from typing import Literal, TypeAlias

from er_gym.data.trajectory import ThoughtKind
from er_gym.envs.actions import Action
from er_gym.envs.info import REPEATED
from er_gym.rollout.records import ERROR, EpisodeRecord, StepRecord
from er_gym.tasks import verbs

CorrectAfter: TypeAlias = Literal["wrong", "failure", "anywhere", "refusal"]
"""After which action of a failed episode another agent takes over:

- ``wrong``: the first that did no key action, as in the paper (arXiv 2503.21696).
- ``failure``: the first since the last key action that the environment refused. Where the same
  action a fourth time ended the episode and nothing was refused before, it is the third time. Where
  there is none, or it leaves fewer than :data:`ROOM` steps, it is the first wrong one after all.
- ``anywhere``: up to :data:`DRAWS` actions: the third time, where a fourth ended the episode; then
  others drawn at random, first among the refused ones. Each begins its own correction, so that the
  states of the failed agent are learnt from, as in DAgger (Ross et al. 2011, arXiv 1011.0686).
- ``refusal``: as ``anywhere``, but after refused actions only, for an agent that goes on as if
  nothing had been refused.
"""
SEVERAL: frozenset[CorrectAfter] = frozenset(("anywhere", "refusal"))
"""Those that begin several corrections of an episode."""
ROOM = 10
"""Steps that the expert needs after a failure."""
DRAWS = 6
"""Corrections of one episode, at most, where it is corrected at several actions."""


@dataclass(frozen=True)
class Beginning:
    """The beginning of a failed episode.

    Attributes:
        actions: up to the one after which the expert takes over, that one included.
        problem: why there is none, ``""`` if there is.
        agent: who failed, where its thoughts are kept.
        said: then, for each action, kind and text of the thoughts before it.
    """

    actions: tuple[Action, ...] = ()
    problem: str = ""
    agent: str = ""
    said: tuple[tuple[tuple[ThoughtKind, str], ...], ...] = ()

    @property
    def first_wrong(self) -> int:
        """The index of the first wrong action."""
        return len(self.actions) - 1


def correction_points(
    episode: EpisodeRecord, after: CorrectAfter = "wrong", max_steps: int | None = None
) -> list[Beginning]:
    """The beginnings of a failed episode that are corrected; one that has a ``problem`` if none.

    Args:
        episode: what failed.
        after: after which actions another agent takes over.
        max_steps: the step limit of the corrections; None for that of the episode.
    """
    limit = max_steps or episode.max_steps
    if after == "wrong" or after == "failure":
        return [first_mistake(episode, after, limit)]
    if episode.success or episode.error:
        return [first_mistake(episode)]
    steps = episode.steps[1:]
    end = len(steps) - 1 if episode.end_reason == REPEATED else len(steps)
    end = min(end, limit - ROOM - 1)  # placing the agent was a step, too
    readable = next((n for n, one in enumerate(steps) if one.verb in (ERROR, verbs.END)), end)
    places = [
        place
        for place in range(min(readable, end))
        if after == "anywhere" or not steps[place].success
    ]
    if not places:
        which = "action" if after == "anywhere" else "refused action"
        return [Beginning(problem=f"no {which} leaves room for a correction")]
    third = len(steps) - 2 if episode.end_reason == REPEATED else None
    drawn = Random(episode.key).sample(places, len(places))
    drawn.sort(key=lambda place: (place != third, steps[place].success))  # else as drawn
    return [_until(steps, place) for place in sorted(drawn[:DRAWS])]


def first_mistake(
    episode: EpisodeRecord,
    after: Literal["wrong", "failure"] = "wrong",
    max_steps: int | None = None,
) -> Beginning:
    """The actions of a failed episode up to the one that is corrected.

    The arguments are those of :func:`correction_points`.
    """
    if episode.success:
        return Beginning(problem="the episode succeeded")
    if episode.error:
        return Beginning(problem="the episode crashed")
    steps = episode.steps[1:]
    wrong = _corrected(episode, after, max_steps or episode.max_steps)
    if wrong is None:
        return Beginning(problem="nothing was wrong before the steps ran out")
    last = steps[wrong]
    if last.appended or last.verb == verbs.END:
        return Beginning(problem="it ended too early, and nothing was wrong before")
    if any(step.verb == ERROR for step in steps[: wrong + 1]):
        return Beginning(problem="its first wrong reply names no action")
    return _until(steps, wrong)


def _until(steps: Sequence[StepRecord], last: int) -> Beginning:
    """The actions up to the one with this index."""
    return Beginning(tuple(Action(step.verb, step.object_type) for step in steps[: last + 1]))


def _corrected(episode: EpisodeRecord, after: CorrectAfter, max_steps: int) -> int | None:
    """The index of the action that is corrected, from 0; None if every one did a key action."""
    steps = episode.steps[1:]
    did = [step.reward > 0 for step in steps]
    if after == "failure":
        last_key = max((number for number, earned in enumerate(did) if earned), default=-1)
        end = min(len(steps), max_steps - ROOM - 1)  # placing the agent was a step, too
        for number in range(last_key + 1, end):
            if not steps[number].success and steps[number].verb not in (ERROR, verbs.END):
                if episode.end_reason != REPEATED or number < len(steps) - 1:
                    return number
                if number - 1 > last_key:
                    return number - 1
    return next((number for number, earned in enumerate(did) if not earned), None)
