"""What turns earn: a table of rewards by name, each of which is weighed and logged by itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeAlias

from agents.reinforce.episodes import steps_of
from er_gym.plugins import PluginError, Registry
from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.tasks import verbs

TurnReward: TypeAlias = Callable[[EpisodeRecord], Sequence[float]]
"""What each turn of an episode earns, (turns,), before it is weighed; a penalty is negative."""


def _success(record: EpisodeRecord) -> list[float]:
    """1 for the last turn of an episode that did its task."""
    turns = len(steps_of(record))
    return [0.0] * (turns - 1) + [float(record.success)] * (turns > 0)


def _key_actions(record: EpisodeRecord) -> list[float]:
    """The share of the task's key actions that a turn did; 1 for all of them."""
    most = sum(key.reward for key in record.key_actions) or 1.0
    return [max(step.reward, 0.0) / most for step in steps_of(record)]


def _illegal(record: EpisodeRecord) -> list[float]:
    """-1 for an action that was not possible."""
    return [-float(not step.success and step.verb != ERROR) for step in steps_of(record)]


def _unreadable(record: EpisodeRecord) -> list[float]:
    """-1 for a reply that named no known action."""
    return [-float(step.verb == ERROR) for step in steps_of(record)]


def _repeated(record: EpisodeRecord) -> list[float]:
    """-1 for the same action as in the turn before; stepping forward again is none."""
    steps = steps_of(record)
    found = [0.0] * len(steps)
    for turn in range(1, len(steps)):
        before, now = steps[turn - 1], steps[turn]
        same = (before.verb, before.object_type) == (now.verb, now.object_type)
        if same and not (now.verb == verbs.MOVE_FORWARD and before.success):
            found[turn] = -1.0
    return found


def _false_end(record: EpisodeRecord) -> list[float]:
    """-1 for ending an episode whose task is not done."""
    return [-float(step.verb == verbs.END and not record.success) for step in steps_of(record)]


def _thoughtless(record: EpisodeRecord) -> list[float]:
    """-1 for a decision without a thought before it."""
    return [-float(not step.thought.strip()) for step in steps_of(record)]


def _turns(record: EpisodeRecord) -> list[float]:
    """For each turn, minus its share of the most that the episode may have."""
    return [-1.0 / record.max_steps] * len(steps_of(record))


REWARDS: Registry[TurnReward] = Registry(
    kind="reward of turns",
    group="er_gym.turn_rewards",
    own={
        "success": _success,
        "key_actions": _key_actions,
        "illegal": _illegal,
        "unreadable": _unreadable,
        "repeated": _repeated,
        "false_end": _false_end,
        "thoughtless": _thoughtless,
        "turns": _turns,
    },
    expected=f"a function as {__name__}.TurnReward: from an episode's record to a number a turn",
    fits=callable,
)
"""The rewards by name."""


def rewards_of(record: EpisodeRecord, weights: Mapping[str, float]) -> dict[str, list[float]]:
    """What each turn of an episode earned, (turns,), by the name of the reward and weighed.

    Raises:
        PluginError: there is no such reward, or it does not give a number for each turn.
    """
    turns = len(steps_of(record))
    found = {}
    for name, weight in weights.items():
        earned = list(REWARDS.get(name)(record))
        if len(earned) != turns:
            raise PluginError(
                f"the reward {name!r} gives {len(earned)} numbers for {turns} turns; give one each"
            )
        found[name] = [weight * each for each in earned]
    return found
