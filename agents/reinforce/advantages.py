"""How much better than expected each turn was: a table of ways to tell, as pure functions.

Each row is given the episodes of one group, which played the same task, and gives a number for each
of their turns. A turn with a positive number becomes likelier, one with a negative number rarer.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import fmean, pstdev
from typing import TypeAlias

from agents.reinforce.episodes import ScoredEpisode
from agents.reinforce.settings import AdvantageSettings
from er_gym.plugins import Registry

Advantages: TypeAlias = list[list[float]]
"""(episodes, turns of each)."""
Group: TypeAlias = Sequence[ScoredEpisode]
_LEAST_DEVIATION = 1e-6


@dataclass(frozen=True)
class AdvantageRow:
    """A way to tell how much better than expected a turn was.

    Attributes:
        of: the advantages of a group's turns.
        compares: whether episodes are compared with each other, so that those of a group that all
            earned the same have nothing to tell.
        values: whether it needs what is earned from a state on, for which episodes are continued
            from their states.
    """

    of: Callable[[Group, AdvantageSettings], Advantages]
    compares: bool = True
    values: bool = False


def _for_all_turns(group: Group, each: Sequence[float]) -> Advantages:
    """An episode's advantage as that of each of its turns."""
    return [[one] * len(e.rewards) for e, one in zip(group, each, strict=True)]


def _less_mean(values: Sequence[float], *, divided: bool = False) -> list[float]:
    mean = fmean(values)
    by = pstdev(values) if divided else 1.0
    return [(each - mean) / by if by > _LEAST_DEVIATION else 0.0 for each in values]


def _grpo(group: Group, settings: AdvantageSettings) -> Advantages:
    """What the episode earned, less the group's mean, by the group's deviation (GRPO)."""
    return _for_all_turns(group, _less_mean([e.total for e in group], divided=True))


def _mean(group: Group, settings: AdvantageSettings) -> Advantages:
    """What the episode earned, less the group's mean (Dr. GRPO)."""
    return _for_all_turns(group, _less_mean([e.total for e in group]))


def _rloo(group: Group, settings: AdvantageSettings) -> Advantages:
    """What the episode earned, less the mean of the others (RLOO); nothing for a group of one."""
    totals = [e.total for e in group]
    others = max(len(totals) - 1, 1)
    everything = sum(totals)
    return _for_all_turns(
        group, [each - (everything - each) / others if len(totals) > 1 else 0.0 for each in totals]
    )


def returns(rewards: Sequence[float], discount: float) -> list[float]:
    """What is earned from each turn on, (turns,), later rewards discounted."""
    found, later = [0.0] * len(rewards), 0.0
    for turn in reversed(range(len(rewards))):
        found[turn] = later = rewards[turn] + discount * later
    return found


def _gigpo(group: Group, settings: AdvantageSettings) -> Advantages:
    """That of the episode as ``mean``, and that of the step (GiGPO): what was earned from a turn
    on, less the mean over all turns of the group with the same anchor."""
    whole = _mean(group, settings)
    earned = [returns(e.rewards, settings.discount) for e in group]
    at_anchor: dict[str, list[float]] = defaultdict(list)
    for e, values in zip(group, earned, strict=True):
        for anchor, value in zip(e.anchors, values, strict=True):
            at_anchor[anchor].append(value)
    expected = {anchor: fmean(values) for anchor, values in at_anchor.items()}
    return [
        [
            of_episode + settings.step_weight * (value - expected[anchor])
            for of_episode, value, anchor in zip(row, values, e.anchors, strict=True)
        ]
        for e, row, values in zip(group, whole, earned, strict=True)
    ]


def _branches(group: Group, settings: AdvantageSettings) -> Advantages:
    """What a turn earned and what its next state is worth, less what its state was worth, as
    continuing the episode from both told (VinePPO). Turns between two such states share theirs."""
    found = []
    for e in group:
        known = [turn for turn, value in enumerate(e.values) if value is not None]
        row = [0.0] * len(e.rewards)
        for start, end in zip(known, [*known[1:], len(row)], strict=True):
            earned = sum(
                settings.discount ** (turn - start) * e.rewards[turn] for turn in range(start, end)
            )
            after = e.values[end] if end < len(row) else 0.0
            gained = earned + settings.discount ** (end - start) * (after or 0.0)
            row[start:end] = [gained - (e.values[start] or 0.0)] * (end - start)
        found.append(row)
    return found


def _successes(group: Group, settings: AdvantageSettings) -> Advantages:
    """1 for all turns of an episode that did its task, 0 for others: imitation of successes."""
    return _for_all_turns(group, [float(e.success) for e in group])


ADVANTAGES: Registry[AdvantageRow] = Registry(
    kind="advantage",
    group="er_gym.advantages",
    own={
        "grpo": AdvantageRow(_grpo),
        "mean": AdvantageRow(_mean),
        "rloo": AdvantageRow(_rloo),
        "gigpo": AdvantageRow(_gigpo),
        "branches": AdvantageRow(_branches, compares=False, values=True),
        "successes": AdvantageRow(_successes, compares=False),
    },
    expected=f"an {__name__}.AdvantageRow",
    fits=lambda row: isinstance(row, AdvantageRow),
)
"""The ways by name."""


def spread(group: Group) -> float:
    """By how much the episode of a group that earned most differs from the one that earned least;
    where they are equal, there is nothing to compare."""
    totals = [e.total for e in group]
    found = max(totals) - min(totals)
    return found if found > _LEAST_DEVIATION else 0.0


def widest(group: Group, most: int) -> list[int]:
    """The places of the episodes of a group that differ most in what they earned (PODS).

    They are some of those that earned least and some of those that earned most: of all such
    choices that with the greatest variance, and thus of all choices (arXiv 2504.13818).

    Args:
        group: the episodes.
        most: how many; all places if the group has no more.
    """
    totals = [e.total for e in group]
    order = sorted(range(len(totals)), key=totals.__getitem__)
    if len(order) <= most:
        return sorted(order)
    choices = [order[:low] + order[len(order) - most + low :] for low in range(most + 1)]
    return sorted(max(choices, key=lambda places: pstdev(totals[place] for place in places)))
