"""What a model did and earned in an episode, turn by turn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from agents.vlm.chat import Picture
from er_gym.rollout.records import EpisodeRecord, StepRecord


@dataclass(frozen=True)
class Turn:
    """A reply of the model.

    Attributes:
        prompt: the tokens that it was given.
        said: the tokens of the reply, the one that ends it included.
        scores: (said,) the logarithm of the probability with which each was drawn; empty if the
            sampler does not tell.
        anchor: a digest of what the agent had observed and done before
            (:func:`er_gym.envs.observations.anchor_of`).
        pictures: those of the prompt, in order, as the model was sent them.
    """

    prompt: Sequence[int]
    said: Sequence[int]
    scores: Sequence[float]
    anchor: str
    pictures: Sequence[Picture] = ()


@dataclass(frozen=True)
class Episode:
    """An episode that a model has played.

    Attributes:
        record: its record; ``task_id`` is that of the task, ``sample`` its number in the group.
        turns: the replies, one for each step of the agent.
        values: what was earned on average from before each turn on, where the episode was continued
            from there (:mod:`agents.reinforce.branches`); None elsewhere.
        start: before which turn of another episode it began, from 0; 0 for the beginning.
    """

    record: EpisodeRecord
    turns: tuple[Turn, ...]
    values: tuple[float | None, ...] = ()
    start: int = 0

    @property
    def group(self) -> tuple[str, int]:
        """Names the episodes with which it is compared: those of its task with its start."""
        return self.record.task_id, self.start

    @property
    def steps(self) -> list[StepRecord]:
        """The step that each turn led to, (turns,)."""
        return steps_of(self.record)


def steps_of(record: EpisodeRecord) -> list[StepRecord]:
    """The steps that an agent decided, without its placing and an ``end`` that was appended."""
    return [step for step in record.steps[1:] if not step.appended]


@dataclass(frozen=True)
class ScoredEpisode:
    """What an advantage is computed from.

    Attributes:
        rewards: (turns,) what each turn earned, all rewards together.
        anchors: (turns,) see :class:`Turn`.
        success: whether the task was done.
        values: (turns,) see :class:`Episode`; empty if nothing was continued.
    """

    rewards: tuple[float, ...]
    anchors: tuple[str, ...]
    success: bool
    values: tuple[float | None, ...] = ()

    @property
    def total(self) -> float:
        """What the episode earned."""
        return sum(self.rewards)


def scored(episode: Episode, rewards: Mapping[str, Sequence[float]]) -> ScoredEpisode:
    """An episode with the rewards of each name, (turns,), added up."""
    turns = len(episode.turns)
    return ScoredEpisode(
        rewards=tuple(sum(row[turn] for row in rewards.values()) for turn in range(turns)),
        anchors=tuple(turn.anchor for turn in episode.turns),
        success=episode.record.success,
        values=episode.values,
    )
