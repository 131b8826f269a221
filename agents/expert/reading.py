"""Lets a model read the thoughts of trajectories that are there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

from agents.expert.writers.reader import READER, Critic
from er_gym.data.knowledge import knowledge_at
from er_gym.data.trajectory import Trajectory
from er_gym.data.verify import MOST_WORDS

_AHEAD = 4
"""So many trajectories for each thread are read from the file at once."""


def objections(
    trajectories: Iterable[Trajectory], critic: Critic, concurrency: int = 1
) -> Iterator[tuple[str, str]]:
    """The id of a trajectory and an objection of the critic's model, for each, in order.

    What the rules refuse is left to :func:`er_gym.data.verify.thought_problems`.

    Args:
        trajectories: the trajectories.
        critic: reads their thoughts.
        concurrency: how many trajectories are read at once.

    Raises:
        CannotGoOn: the model cannot be asked any more.
    """
    waiting = iter(trajectories)
    with ThreadPoolExecutor(concurrency) as pool:
        while some := list(islice(waiting, _AHEAD * concurrency)):
            for each, found in zip(
                some, pool.map(lambda one: [*_objections(one, critic)], some), strict=True
            ):
                yield from ((each.id, line) for line in found)


def _objections(trajectory: Trajectory, critic: Critic) -> Iterator[str]:
    for index, turn in enumerate(trajectory.turns):
        if not turn.thoughts:
            continue
        known = knowledge_at(
            trajectory.turns,
            index,
            instruction=trajectory.instruction,
            language=trajectory.language,
        )
        for thought in turn.thoughts:
            checked = critic.check(thought.text, thought.kind, known, limit=MOST_WORDS)
            for refusal in checked.refusals:
                if refusal.code == READER:
                    yield f"turn {index}: {thought.kind}: {refusal.code}: {refusal.detail}"
