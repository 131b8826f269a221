"""The thoughts in the replies of a model that played a run, with their kinds."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from pydantic import ValidationError

from agents.expert.acceptance import steps_of
from agents.vlm.record import ConversationRecord, MessageRecord, RoundRecord
from er_gym.data.dialects import dialect_names, load_dialect
from er_gym.data.trajectory import TAG_OF_KIND, Language, ThoughtKind
from er_gym.rollout.agent import ModelReply
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import CONVERSATIONS
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem

KIND_OF_TAG: Mapping[str, ThoughtKind] = {tag: kind for kind, tag in TAG_OF_KIND.items()}
_UNSAID: ThoughtKind = "reasoning"
"""The kind of a thought whose kind nothing says."""
_ENDS = (".", "!", "?", "…", "。", "！", "？", "\n", '"', "”")
"""A sentence ends with one of these."""


@dataclass(frozen=True)
class RecordedThoughts:
    """What a model thought at one turn.

    Attributes:
        thoughts: kind and text of each, in order.
        reply: what the reply cost.
    """

    thoughts: tuple[tuple[ThoughtKind, str], ...]
    reply: ModelReply


@dataclass(frozen=True)
class RecordedReplies:
    """What a model said in an episode.

    Attributes:
        turns: one for each reply.
        language: of its prompts.
        tokens: the length of the whole conversation, in the model's tokens; 0 if unknown.
    """

    turns: tuple[RecordedThoughts, ...]
    language: Language
    tokens: int

    @property
    def silent(self) -> bool:
        """Whether no reply has a thought, as with a model that was trained on actions alone."""
        return not any(turn.thoughts for turn in self.turns)


def recorded_replies(run: Path, episode: EpisodeRecord) -> RecordedReplies | None:
    """What the model of a run said in an episode; None if the agent had no conversation.

    Raises:
        ValueError: the conversation cannot be read, or is not that of the episode.
    """
    file = run / CONVERSATIONS / f"{file_stem(episode.key)}.json"
    if not file.is_file():
        return None
    try:
        record = ConversationRecord.model_validate_json(read_bytes(file))
    except (TaskFileError, ValidationError):
        raise ValueError(f"{file} cannot be read as a conversation") from None
    steps = steps_of(episode)
    if len(record.rounds) != len(steps) or record.task_id != episode.key:
        raise ValueError(
            f"{file} has {len(record.rounds)} replies about {record.task_id!r:.80}, but the "
            f"episode has {len(steps)} steps; it is of another episode"
        )
    prompts = record.settings.get("prompts", {})
    language: Language = "zh" if prompts.get("language") == "zh" else "en"
    dialect = str(prompts.get("dialect") or "")
    return RecordedReplies(
        tuple(_said(each, record.messages, dialect, language) for each in record.rounds),
        language,
        max((each.prompt_tokens + each.completion_tokens for each in record.rounds), default=0),
    )


def _said(
    this: RoundRecord, messages: Sequence[MessageRecord], dialect: str, language: Language
) -> RecordedThoughts:
    message = messages[this.message] if this.message < len(messages) else None
    text = (
        "" if message is None else "".join(each for each in message.parts if isinstance(each, str))
    )
    thoughts: list[tuple[ThoughtKind, str]] = []
    for each in this.thoughts:
        kind = KIND_OF_TAG.get(each.kind, _UNSAID)
        words = each.text.strip()
        if kind == _UNSAID and text.lstrip().startswith(words):  # not in a tag
            thoughts += split_speech(words, dialect, language)
        elif words:
            thoughts.append((kind, words))
    if not thoughts and message is not None and message.reasoning.strip():
        thoughts = [(_UNSAID, message.reasoning.strip())]
    reply = ModelReply(
        model=this.model,
        seconds=this.seconds,
        prompt_tokens=this.prompt_tokens,
        completion_tokens=this.completion_tokens,
        cost=this.cost,
    )
    return RecordedThoughts(tuple(thoughts), reply)


def split_speech(text: str, dialect: str, language: Language) -> list[tuple[ThoughtKind, str]]:
    """Running speech as thoughts: each begins with an opener of its kind.

    The openers, and the closer at the end, are the dialect's words and not the model's thought, so
    they are left out; an export adds new ones. What comes before the first opener has no kind of
    its own and counts as spatial reasoning.

    Args:
        text: a reply without its decision.
        dialect: whose openers; ``""`` for those of all dialects with running speech.
        language: of the reply.
    """
    speech = _speech(dialect, language)
    text = text.strip()
    for closer in speech.closers:
        if text.endswith(closer):
            text = text.removesuffix(closer).rstrip()
            break
    found: list[tuple[ThoughtKind, str]] = []
    kind, begin = _UNSAID, 0
    for start, end, opened in [*_openers(text, speech), (len(text), len(text), _UNSAID)]:
        words = text[begin:start].strip()
        if words:
            found.append((kind, words))
        kind, begin = opened, end
    return found


@dataclass(frozen=True)
class _Speech:
    """The fixed sentences of running speech."""

    openers: Mapping[str, ThoughtKind]
    closers: tuple[str, ...]
    any_opener: re.Pattern[str]


def _openers(text: str, speech: _Speech) -> Iterator[tuple[int, int, ThoughtKind]]:
    """Where openers stand as sentences of their own: start, end and kind."""
    if not speech.openers:
        return
    for match in speech.any_opener.finditer(text):
        before = text[: match.start()].rstrip(" ")
        if not before or before.endswith(_ENDS):
            yield match.start(), match.end(), speech.openers[match[0]]


@lru_cache(maxsize=16)
def _speech(dialect: str, language: Language) -> _Speech:
    openers: dict[str, ThoughtKind] = {}
    closers: list[str] = []
    for name in (dialect,) if dialect else dialect_names():
        try:
            texts = load_dialect(name).texts.get(language)
        except ValueError:  # a dialect that is no longer there
            continue
        if texts is not None and texts.thoughts == "speech":
            for kind, sentences in texts.openers.items():
                openers |= dict.fromkeys(sentences, kind)
            closers += texts.closers
    longest_first = sorted(openers, key=len, reverse=True)
    return _Speech(
        openers,
        tuple(sorted(closers, key=len, reverse=True)),
        re.compile("|".join(map(re.escape, longest_first))),
    )
