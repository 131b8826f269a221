"""What the pages say of an episode: its steps with thoughts, replies, pictures and key actions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from agents.vlm.record import ConversationRecord, MessageRecord, PictureRecord, RoundRecord
from agents.vlm.requests import as_sent
from benchmarks.monitor.failures import Failure, failure_of
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.judgement import judged_by_step
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.rollout.run_directory import CONVERSATIONS, PICTURES, RunDirectory
from er_gym.tasks.task import type_of_id
from er_gym.tasks.verbs import INIT
from er_gym.writing import file_stem, inside

_MOST_BYTES = 64 * 2**20
"""A larger conversation is not read."""
MOST_TEXT = 4_000
"""Characters of a text that a page shows at once; the rest follows on demand."""


@dataclass(frozen=True)
class ThoughtView:
    """A thought: its kind, ``""`` if it has none, and its text."""

    kind: str
    text: str


@dataclass(frozen=True)
class StepView:
    """A step, and what led to it.

    Attributes:
        number: from 0, which placed the agent.
        record: as the episode has it.
        thoughts: what the agent thought before it.
        raw: what the model said; "" for agents that are no models.
        round: the reply's record; None for such agents.
        sent: the messages that were new in the request for it, the system message in the first.
        pictures: the numbers of the episode's pictures that the agent was shown for it.
        total: the reward so far.
        done: the numbers of the key actions that were done for the first time in it.
    """

    number: int
    record: StepRecord
    thoughts: Sequence[ThoughtView]
    raw: str
    round: RoundRecord | None
    sent: Sequence[MessageRecord]
    pictures: Sequence[int]
    total: float
    done: Sequence[int]

    @property
    def action(self) -> str:
        """The action in words."""
        return f"{self.record.verb} {self.record.object_type}".strip()


@dataclass(frozen=True)
class SideEffect:
    """What the agent changed that the task did not ask for.

    Attributes:
        kind: one of :data:`er_gym.tasks.side_effects.KINDS`.
        object_id: of what was changed.
    """

    kind: str
    object_id: str

    @property
    def object_type(self) -> str:
        """The type of what was changed."""
        return type_of_id(self.object_id)


@dataclass(frozen=True)
class EpisodeView:
    """An episode.

    Attributes:
        record: the record.
        steps: from the first, which placed the agent.
        pictures: that the agent was shown, in order; relative to the run directory.
        failure: why it failed; None if it did not.
        success: by the corrected scorer.
        tokens, cost: of the model's replies; 0 for agents that are no models.
        problem: why the conversation cannot be shown; "" if it can, or there is none.
        conversation: the record of the conversation; None if there is none to show.
    """

    record: EpisodeRecord
    steps: Sequence[StepView]
    pictures: Sequence[PictureRecord]
    failure: Failure | None
    success: bool
    tokens: int
    cost: float
    problem: str
    conversation: ConversationRecord | None = None

    @property
    def side_effects(self) -> list[SideEffect] | None:
        """Its side effects; None if the record does not tell them."""
        if self.record.side_effects is None:
            return None
        told = (each.partition(" ") for each in self.record.side_effects)
        return [SideEffect(kind, object_id) for kind, _, object_id in told]

    def request(self, number: int) -> list[MessageRecord]:
        """The request for a step, with all messages as they were sent.

        Raises:
            ValueError: no model was asked for this step.
        """
        step = self.steps[number] if 0 <= number < len(self.steps) else None
        if step is None or step.round is None or step.round.by or self.conversation is None:
            raise ValueError(f"no model was asked for step {number}")
        return as_sent(self.conversation, self.conversation.rounds.index(step.round))


def view_of(run: RunDirectory, key: str) -> EpisodeView:
    """An episode of a run.

    Raises:
        ValueError: there is none, or its file is not usable.
    """
    record = run.episode(key)
    conversation, problem = _conversation(run.path, key)
    pictures: list[PictureRecord] = []
    steps = tuple(_steps(record, conversation, pictures))
    return EpisodeView(
        record=record,
        steps=steps,
        pictures=pictures,
        failure=failure_of(record),
        success=CORRECTED.count(record).success,
        tokens=conversation.prompt_tokens + conversation.completion_tokens if conversation else 0,
        cost=conversation.cost if conversation else 0.0,
        problem=problem,
        conversation=conversation,
    )


def view_so_far(record: EpisodeRecord) -> EpisodeView:
    """An episode that is under way, without the conversation, which is written at its end."""
    return EpisodeView(
        record=record,
        steps=tuple(_steps(record, None, [])),
        pictures=(),
        failure=None,
        success=False,
        tokens=0,
        cost=0.0,
        problem="",
    )


def picture_file(run: Path, picture: PictureRecord) -> Path | None:
    """The file of a picture; None unless it is a regular file in the run's folder of pictures."""
    return file_inside(run, PICTURES, picture.path)


def file_inside(root: Path, folder: str, path: str) -> Path | None:
    """A file; None unless it is a regular one in a folder of ``root``.

    Args:
        root: a directory.
        folder: relative to it.
        path: relative to ``root``; it comes from a file that anyone may have written.
    """
    try:
        within, found = (inside(root, each, links=False) for each in (folder, path))
    except (ValueError, OSError):
        return None
    return found if found.is_relative_to(within) and found.is_file() else None


def _conversation(run: Path, key: str) -> tuple[ConversationRecord | None, str]:
    """The conversation of an episode, and why it cannot be shown."""
    file = run / CONVERSATIONS / f"{file_stem(key)}.json"
    try:
        if file.is_symlink() or not file.is_file():
            return None, ""
        if file.stat().st_size > _MOST_BYTES:
            return None, f"{file.name} has more than {_MOST_BYTES >> 20} MiB"
        return ConversationRecord.model_validate_json(file.read_bytes()), ""
    except (OSError, ValidationError, ValueError) as error:
        return None, f"{file.name} cannot be read: {str(error).splitlines()[0]}"


def _steps(
    record: EpisodeRecord, conversation: ConversationRecord | None, pictures: list[PictureRecord]
) -> Iterator[StepView]:
    """The steps; the pictures that the agent was shown are added to ``pictures``."""
    rounds = iter(conversation.rounds if conversation else ())
    messages = conversation.messages if conversation else ()
    total, read = 0.0, 0
    progress = judged_by_step(record)
    keys = [*progress[0].criteria.key_actions] if progress else []
    number_of = {id(key): number for number, key in enumerate(keys)}
    done_before = 0
    for number, step in enumerate(record.steps):
        round_ = None if step.verb == INIT or step.appended else next(rounds, None)
        raw, shown = "", []
        sent: Sequence[MessageRecord] = ()
        if round_ is not None and round_.message < len(messages):
            sent = messages[read : round_.message]
            for message in sent:
                for part in message.parts:
                    if isinstance(part, PictureRecord):
                        shown.append(len(pictures))
                        pictures.append(part)
            reply = messages[round_.message]
            said = [part for part in reply.parts if isinstance(part, str)]
            raw = "\n".join([reply.reasoning] * bool(reply.reasoning) + said)
            read = round_.message + 1
        total += step.reward
        done = progress[number].done
        newly, done_before = done[done_before:], len(done)
        yield StepView(
            number=number,
            record=step,
            thoughts=_thoughts(step, round_),
            raw=raw,
            round=round_,
            sent=sent,
            pictures=shown,
            total=total,
            done=[number_of[id(key)] for key in newly],
        )


def _thoughts(step: StepRecord, round_: RoundRecord | None) -> list[ThoughtView]:
    if round_ is not None and round_.thoughts:
        return [ThoughtView(each.kind, each.text) for each in round_.thoughts]
    return [ThoughtView("", step.thought)] if step.thought else []
