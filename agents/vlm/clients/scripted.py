"""Clients without a model: one calls a function, one replays recorded conversations."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from pydantic import ValidationError

from agents.vlm.chat import LEFT_OUT, Message, ModelError, Picture, Reply
from agents.vlm.record import ConversationRecord, PictureRecord
from er_gym.tasks.errors import TaskFileError, first_problem
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem

_log = logging.getLogger(__name__)


class ScriptedClient:
    """Replies with the result of a function: a text or a whole reply.

    Args:
        say: called with the messages, from many threads at once.
    """

    identity = '{"client":"scripted"}'

    def __init__(self, say: Callable[[Sequence[Message]], str | Reply]) -> None:
        self._say = say

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The function's result."""
        said = self._say(messages)
        return said if isinstance(said, Reply) else Reply(said, model="scripted")

    def close(self) -> None:
        """Do nothing: nothing is open."""


class RecordedClient:
    """Replays the conversations of a run directory.

    A turn is recognised by all texts before it and by the pictures of the last message, so the
    environment must show the same pictures as then.

    Args:
        run: the run directory, or the file of one conversation.

    Raises:
        ValueError: the run has no readable conversation. Files that do not belong to the run
            (broken, copied, of another agent) are skipped with a warning each.
    """

    def __init__(self, run: Path) -> None:
        files = [run] if run.is_file() else sorted((run / "conversations").glob("*.json"))
        if not files:
            raise ValueError(
                f"{run} holds no conversations; give a run directory of er-gym bench with a "
                "vision-language agent, or the file of one conversation"
            )
        self._run = run
        self._replies: dict[str, Reply] = {}
        wrong = []
        for file in files:
            try:
                self._replies |= _replies(_read(file, None if run.is_file() else _agent_of(run)))
            except ValueError as error:
                wrong.append(str(error))
        if len(wrong) == len(files):
            raise ValueError(wrong[0])
        for each in wrong:
            _log.warning("%s; it is skipped", each)
        everything = "".join(sorted(self._replies))
        self.identity = f'{{"recorded":"{hashlib.sha256(everything.encode()).hexdigest()}"}}'

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The recorded reply.

        Raises:
            ModelError: the recording has no reply to this conversation.
        """
        turns = [_Turn.of(message.role, message.parts) for message in messages]
        reply = self._replies.get(_key(turns))
        if reply is None:
            raise ModelError(
                f"no conversation in {self._run} has this turn (number {len(messages)}); the task, "
                "the prompts or the pictures are not those of the recording"
            )
        return reply

    def close(self) -> None:
        """Do nothing: nothing is open."""


class _Turn(NamedTuple):
    """The key of a message: ``seen`` has the texts and the digests of pictures; ``said`` has the
    texts alone, since later requests may leave out a picture."""

    role: str
    seen: tuple[str, ...]
    said: str

    @staticmethod
    def of(role: str, parts: Iterable[str | Picture | PictureRecord]) -> _Turn:
        parts = tuple(parts)
        texts = (part for part in parts if isinstance(part, str) and part != LEFT_OUT)
        seen = tuple(part if isinstance(part, str) else part.digest for part in parts)
        return _Turn(role, seen, "\n".join(texts))


def _key(turns: Iterable[_Turn]) -> str:
    *before, last = turns
    said = [*(f"{turn.role}\x1f{turn.said}" for turn in before), "\x1f".join(last.seen)]
    return hashlib.sha256("\x1e".join(said).encode()).hexdigest()


def _agent_of(run: Path) -> str:
    """The agent of a run directory, "" if it is not stated."""
    try:
        told = json.loads(read_bytes(run / "run.json"))
    except (TaskFileError, ValueError):
        return ""
    agent = told.get("agent") if isinstance(told, dict) else None
    return agent if isinstance(agent, str) else ""


def _read(file: Path, agent: str | None) -> ConversationRecord:
    """Read a conversation; ``agent`` is the run's agent, None for a file outside of a run."""
    try:
        kept = ConversationRecord.model_validate_json(read_bytes(file))
    except (TaskFileError, ValidationError) as error:
        told = first_problem(error)
        raise ValueError(f"{file} cannot be read as a conversation: {told}") from None
    name = f"{file_stem(kept.task_id)}.json"
    if agent is not None and file.name != name:
        raise ValueError(f"{file} is a copy: it holds the conversation of {name}")
    if agent and kept.agent != agent:
        raise ValueError(f"{file} is of another run: its agent is {kept.agent!r}, not {agent!r}")
    return kept


def _replies(kept: ConversationRecord) -> Mapping[str, Reply]:
    turns = [_Turn.of(message.role, message.parts) for message in kept.messages]
    return {
        _key(turns[: each.message]): Reply(
            text=turns[each.message].said,
            reasoning=kept.messages[each.message].reasoning,
            usage=each.usage,
            cost=each.cost,
            finish=each.finish,
            model=each.model,
            from_cache=True,
        )
        for each in kept.rounds
    }
