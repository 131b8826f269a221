"""The file of a submission: a run in JSON Lines, compressed.

The first line is the :class:`Header`. Then each line holds an episode's record or an episode's
conversation, under the episode's key. Nothing in the file is a path, a module or code, so reading
it opens, imports and links nothing.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from agents.vlm.record import ConversationRecord
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import validated
from er_gym.tasks.reading import stream_json_lines

SUFFIX = ".jsonl.gz"
MOST_EPISODES = 20_000
"""The most episodes of a submission."""
_LONGEST = 200
"""The most characters of a name that is shown."""


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Costs(_Strict):
    """What a run cost, by its conversations; zeros where no model was asked.

    Attributes:
        requests: the number of replies.
        prompt_tokens, completion_tokens: their sums.
        usd: US dollars.
    """

    requests: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    usd: float = 0.0

    @staticmethod
    def of(conversations: Iterable[ConversationRecord]) -> Costs:
        """The sums over the replies."""
        rounds = [each for one in conversations for each in one.rounds]
        return Costs(
            requests=len(rounds),
            prompt_tokens=sum(each.prompt_tokens for each in rounds),
            completion_tokens=sum(each.completion_tokens for each in rounds),
            usd=sum(each.cost for each in rounds),
        )


class Claim(_Strict):
    """A mean with its 95 % interval, as the submission states it."""

    mean: float
    low: float | None = None
    high: float | None = None


class Header(_Strict):
    """The first line of a submission.

    Attributes:
        format: the version of this layout.
        name: of the agent, for people.
        by: who submits; "" for nobody.
        manifest: the run's.
        episodes, conversations: how many lines of each kind follow.
        results: scorer to metric to its mean over all episodes.
        costs: of the run.
        versions: package to version, as it was where the submission was packed.
        hardware: what the run was played on, in words; nobody can check it.
        secrets: how many values were looked for in the texts, and not found.
    """

    format: Literal["er-gym/submission/1"] = "er-gym/submission/1"
    name: str = Field(min_length=1, max_length=_LONGEST)
    by: str = Field(default="", max_length=_LONGEST)
    manifest: Manifest
    episodes: int = Field(ge=1, le=MOST_EPISODES)
    conversations: int = Field(ge=0, le=MOST_EPISODES)
    results: dict[str, dict[str, Claim]]
    costs: Costs = Costs()
    versions: dict[str, str] = {}
    hardware: dict[str, str] = {}
    secrets: int = 0


class _Line(_Strict):
    """An episode or a conversation."""

    key: str
    episode: EpisodeRecord | None = None
    conversation: ConversationRecord | None = None


@dataclass(frozen=True)
class Submission:
    """A submission.

    Attributes:
        header: its first line.
        episodes: the records, in the file's order.
        conversations: the conversations by the episode's key.
        repeated: the keys that several lines of a kind have.
    """

    header: Header
    episodes: tuple[EpisodeRecord, ...]
    conversations: Mapping[str, ConversationRecord]
    repeated: tuple[str, ...] = ()


def packed(submission: Submission) -> bytes:
    """The bytes of a submission's file; equal submissions give equal bytes."""
    lines: list[dict[str, Any]] = [submission.header.model_dump(mode="json")]
    for record in submission.episodes:
        lines.append({"key": record.key, "episode": record.model_dump(mode="json")})
    for key, conversation in submission.conversations.items():
        lines.append({"key": key, "conversation": conversation.model_dump(mode="json")})
    text = "".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines)
    return gzip.compress(text.encode(), mtime=0)


def read_submission(path: Path) -> Submission:
    """Read a file that a stranger may have made.

    Raises:
        TaskFileError: it cannot be read, is larger than er-gym reads, or holds something else than
            a submission; the message says where.
    """
    if not path.name.endswith(SUFFIX):
        raise TaskFileError(f"{path}: a submission ends in {SUFFIX}")
    header: Header | None = None
    episodes: list[EpisodeRecord] = []
    conversations: dict[str, ConversationRecord] = {}
    keys: set[str] = set()
    repeated: list[str] = []
    for number, told in stream_json_lines(path):
        if header is None:
            header = validated(Header, told, f"{path}: the first line")
            continue
        line = validated(_Line, told, f"{path}: line {number}")
        if (line.episode is None) == (line.conversation is None):
            raise TaskFileError(f"{path}: line {number} holds neither one episode nor one talk")
        if line.episode is not None:
            if line.episode.key != line.key:
                raise TaskFileError(f"{path}: line {number} names another episode than it holds")
            repeated += [line.key] * (line.key in keys)
            keys.add(line.key)
            episodes.append(line.episode)
        elif line.conversation is not None:
            repeated += [line.key] * (line.key in conversations)
            conversations[line.key] = line.conversation
        if max(len(episodes), len(conversations)) > MOST_EPISODES:
            raise TaskFileError(f"{path}: more than {MOST_EPISODES:,} episodes")
    if header is None:
        raise TaskFileError(f"{path}: empty")
    return Submission(header, tuple(episodes), conversations, tuple(repeated))
