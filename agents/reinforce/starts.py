"""Where the episodes of a group begin: at the beginning, or where the model goes wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from random import Random

from agents.reinforce.episodes import Episode, steps_of
from agents.reinforce.player import Job, Sampler, group_jobs
from agents.reinforce.settings import PlaySettings
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.task import Task


def after_refusals(
    sampler: Sampler, tasks: Sequence[Task], how: PlaySettings, seed: Callable[[str], int]
) -> tuple[list[Episode], list[Job]]:
    """Play each task once, and go back to where an action was refused, or none was named.

    A model that says the refused action again, almost for sure, seldom shows itself another way:
    few of its episodes from the beginning tell what that would bring. So a whole group goes on from
    such a place. Episodes in which nothing was refused have none.

    Args:
        sampler: plays.
        tasks: what is played.
        how: how often episodes go on from a place, from how many places, and how far.
        seed: gives that of an episode's key.

    Returns:
        the episodes from the beginning; and the groups' jobs, each of which takes up environment
        and conversation right after a refused action, drawn at random among those of its episode.
    """
    whole, jobs = [], []
    for job, episode, player in sampler.play(group_jobs(tasks, 1, seed), forks=True):
        whole.append(episode)
        places = turns_after_refusals(episode.record)
        for turn in Random(job.seed).sample(places, min(how.places, len(places))):
            for number in range(1, how.group + 1):
                key = f"{job.key}/{turn}/{number}"
                jobs.append(
                    replace(
                        job,
                        key=key,
                        sample=number,
                        seed=seed(key),
                        agent=player.forks[turn],
                        snapshot=player.snapshots[turn],
                        start=turn,
                        turns=how.turns,
                    )
                )
    return whole, jobs


def turns_after_refusals(record: EpisodeRecord) -> list[int]:
    """The turns, from 0, before which a reply was of no use: its action was not possible, or it
    named none."""
    steps = steps_of(record)
    return [turn for turn in range(1, len(steps)) if not steps[turn - 1].success]


def insists(record: EpisodeRecord) -> list[bool]:
    """For each turn after a refusal, whether it names the same type again, as who opens one drawer
    after another although the last was open already; without a type, the same verb."""
    named = [step.object_type or step.verb for step in steps_of(record)]
    return [named[turn] == named[turn - 1] for turn in turns_after_refusals(record)]
