"""What states are worth, told exactly: episodes are continued from them, several times each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import fmean

from agents.reinforce.advantages import returns
from agents.reinforce.episodes import Episode, scored
from agents.reinforce.player import Job, Player, Sampler
from agents.reinforce.rewards import rewards_of
from agents.reinforce.settings import ReinforceSettings


def with_values(
    sampler: Sampler,
    played: Sequence[tuple[Job, Episode, Player]],
    settings: ReinforceSettings,
    seed: Callable[[str], int],
) -> tuple[list[Episode], int]:
    """Episodes with what was earned on average from their states on, and how often they were
    continued.

    The state before every ``advantage.branch_every``-th turn is taken up in an environment, with
    the conversation that led to it, and ``advantage.branches`` episodes go on from there.

    Args:
        sampler: plays.
        played: the episodes, played with forks.
        settings: of the run.
        seed: gives that of an episode's key.
    """
    how = settings.advantage
    places: list[tuple[int, int]] = []
    jobs: list[Job] = []
    for number, (job, episode, player) in enumerate(played):
        for turn in range(0, len(episode.turns), how.branch_every):
            for branch in range(how.branches):
                key = f"{job.key}/{turn}/{branch}"
                start = replace(
                    job,
                    key=key,
                    seed=seed(key),
                    agent=player.forks[turn],
                    snapshot=player.snapshots[turn],
                )
                jobs.append(start)
                places.append((number, turn))
    by_key = {job.key: place for job, place in zip(jobs, places, strict=True)}
    earned: dict[tuple[int, int], list[float]] = {}
    for job, episode, _ in sampler.play(jobs):
        rewards = scored(episode, rewards_of(episode.record, settings.rewards)).rewards
        earned.setdefault(by_key[job.key], []).append(returns(rewards, how.discount)[0])
    found = []
    for number, (_, episode, _) in enumerate(played):
        values = [
            fmean(earned[number, turn]) if (number, turn) in earned else None
            for turn in range(len(episode.turns))
        ]
        found.append(replace(episode, values=tuple(values)))
    return found, len(jobs)
