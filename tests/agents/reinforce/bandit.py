"""A reward that any model can earn more of: to say characters with an even code."""

from __future__ import annotations

from agents.reinforce.episodes import steps_of
from er_gym.envs.actions import NO_ACTION
from er_gym.rollout.records import EpisodeRecord


def even_letters(record: EpisodeRecord) -> list[float]:
    """The share of a reply's characters whose code is even."""
    said = [step.text.removeprefix(NO_ACTION) for step in steps_of(record)]
    return [sum(ord(each) % 2 == 0 for each in text) / max(len(text), 1) for text in said]
