"""Plays the episodes of a submission again, and compares step by step."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from agents.vlm.pictures import encode
from agents.vlm.record import ConversationRecord, PictureRecord
from agents.vlm.settings import Pictures
from er_gym.envs.actions import NO_ACTION, Action
from er_gym.envs.info import detail
from er_gym.rollout.agent import CannotFinish, Decision
from er_gym.rollout.play import Playable, play_episode
from er_gym.rollout.records import ERROR, EpisodeRecord, StepRecord
from er_gym.tasks.errors import first_problem
from er_gym.tasks.task import Task

_STEP = tuple(name for name in StepRecord.model_fields if name not in ("thought", "text"))
_END = ("max_steps", "success", "goal_unmet", "end_reason", "total_reward", "side_effects")
_SHOWN = 160
LARGEST = 1 << 24
"""The most pixels of a picture that is made to compare it."""


class Repeating:
    """Decides as a record says.

    Args:
        record: of the episode.
        pictures: how its agent encoded pictures; None to draw none.

    Attributes:
        shown: the sha256 of each picture that could be shown, in order.
    """

    def __init__(self, record: EpisodeRecord, pictures: Pictures | None = None) -> None:
        self.obs_mode = "text" if pictures is None else "rgb+text"
        self.shown: list[str] = []
        self._record, self._pictures = record, pictures
        self._steps = iter([each for each in record.steps[1:] if not each.appended])

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Nothing is needed."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The next recorded action."""
        if self._pictures is not None:
            for rgb in (*detail(info, "views").values(), obs["rgb"]):
                data = encode(rgb, self._pictures).data
                self.shown.append(hashlib.sha256(data).hexdigest())
        step = next(self._steps, None)
        if step is None:
            raise CannotFinish("the record has no further step", self._record.cause)
        action: Action | str = step.text
        if not step.text:
            action = NO_ACTION if step.verb == ERROR else Action(step.verb, step.object_type)
        return Decision(action, step.thought, by=step.by, causes=tuple(step.causes))


def played_again(env: Playable, task: Task, record: EpisodeRecord) -> EpisodeRecord:
    """The record that comes out when the recorded actions are done again.

    Args:
        env: like the one of the run.
        task: the episode's.
        record: what is claimed.
    """
    return play_episode(env, Repeating(record), task, record.seed, agent_name=record.agent)


def compared(record: EpisodeRecord, again: EpisodeRecord) -> Iterator[str]:
    """The first step that differs, or what differs at the end."""
    if again.error:
        yield f"it cannot be played: {again.error}"
        return
    for number, (said, found) in enumerate(zip(record.steps, again.steps, strict=False)):
        for name in _STEP:
            mine, its = getattr(said, name), getattr(found, name)
            if mine != its:
                yield f"step {number}: {name} is {_short(mine)}, and the engine says {_short(its)}"
                return
    if len(record.steps) > len(again.steps):
        yield f"the episode is over after step {len(again.steps) - 1} ({again.end_reason})"
        return
    if len(record.steps) < len(again.steps) or (again.gave_up and not record.gave_up):
        yield "the episode goes on after the last step"
        return
    for name in _END:
        mine, its = getattr(record, name), getattr(again, name)
        if mine != its and not (name == "side_effects" and mine is None):
            yield f"{name} is {_short(mine)}, and the engine says {_short(its)}"
            return


def pictures_of(conversation: ConversationRecord) -> list[str]:
    """The sha256 of each picture that the model was shown, in order."""
    parts = (part for message in conversation.messages for part in message.parts)
    return [part.digest for part in parts if isinstance(part, PictureRecord)]


def picture_settings(conversation: ConversationRecord) -> Pictures:
    """How pictures were encoded.

    Raises:
        ValueError: a stranger's settings are none, or ask for pictures that fill the memory.
    """
    try:
        found = Pictures.model_validate(conversation.settings.get("pictures", {}))
    except ValidationError as error:
        raise ValueError(f"the settings of pictures are none: {first_problem(error)}") from None
    if found.min_pixels > LARGEST:
        raise ValueError(f"pictures are to have {found.min_pixels:,} pixels")
    return found


def foreign_pictures(
    env: Playable,
    task: Task,
    record: EpisodeRecord,
    conversation: ConversationRecord,
    settings: Pictures,
) -> Iterator[str]:
    """Which of the pictures the engine does not draw at that place of the episode.

    Args:
        env: like the one of the run, with ``rgb`` and ``text``.
        task, record, conversation: of the episode.
        settings: how pictures were encoded.
    """
    agent = Repeating(record, settings)
    play_episode(env, agent, task, record.seed, agent_name=record.agent)
    drawn = iter(agent.shown)
    for number, digest in enumerate(pictures_of(conversation)):
        if digest not in drawn:  # this takes from the iterator, so the order counts, too
            yield f"picture {number} is none that the engine draws there"
            return


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _SHOWN else f"{text[:_SHOWN]}…"
