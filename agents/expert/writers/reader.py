"""A model as a reader of thoughts: it checks what the critic's rules leave open.

The rules come first, and a thought that they refuse is not asked about. The model is told all facts
of the moment and the thought, and answers claim by claim. A claim counts as false only if the model
names the fact that contradicts it.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from agents.expert.writers.record_facts import Fact, facts_told
from agents.vlm.chat import Client, Message, ModelError, Reply, model_reply
from agents.vlm.prompt_set import without_marks
from agents.vlm.settings import AgentSettings
from agents.vlm.template_files import TemplateFiles
from er_gym.data.critic import Refusal, Review, review
from er_gym.data.knowledge import Knowledge
from er_gym.data.trajectory import ThoughtKind
from er_gym.rollout.agent import ModelReply
from er_gym.tasks.config_folder import config_directory

READER = "reader"
"""The code of a refusal by the model; all other codes are the rules'."""
TRIES = 3
"""The model is asked this often for an answer in the right form."""
_NEEDED = ("role.jinja", "claims.jinja", "again.jinja")
_LONGEST = 300
"""Characters of a claim that are quoted."""
_SEED = 0
"""The same question gets the same answer from the reply cache, whoever asks and when."""
_LARGEST = 100_000
"""Characters of an answer that is read."""


class Claim(BaseModel):
    """A claim as the model read it."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    claim: str
    verdict: Literal["true", "false", "unknown"]
    fact: str = ""


class Claims(BaseModel):
    """The model's answer."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    claims: list[Claim] = Field(max_length=100)


def reader_settings(settings: AgentSettings) -> AgentSettings:
    """The settings of a client, with the form of these answers and the surest sampling."""
    schema: dict[str, Any] = {
        "type": "object",
        "properties": {
            "claims": {
                "type": "array",
                "items": {
                    "type": "object",
                    "properties": {
                        "claim": {"type": "string"},
                        "verdict": {"type": "string", "enum": ["true", "false", "unknown"]},
                        "fact": {"type": "string"},
                    },
                    "required": ["claim", "verdict", "fact"],
                    "additionalProperties": False,
                },
            }
        },
        "required": ["claims"],
        "additionalProperties": False,
    }
    form = {"name": "claims", "strict": True, "schema": schema}
    asked = {"response_format": {"type": "json_schema", "json_schema": form}}
    return settings.model_copy(
        update={
            "sampling": settings.sampling.model_copy(update={"temperature": 0.0}),
            "server": settings.server.model_copy(
                update={"extra": {**asked, **settings.server.extra}}
            ),
        }
    )


@dataclass(frozen=True)
class ReaderPrompts:
    """What the model is told."""

    files: TemplateFiles

    @property
    def digest(self) -> str:
        """sha256 of the templates, in hex."""
        return self.files.digest

    def conversation(self, text: str, parts: Sequence[str], facts: Sequence[Fact]) -> list[Message]:
        """The messages that ask about some parts of a thought."""
        asked = self.files.render(
            "claims.jinja",
            facts=[{"id": each.id, "text": without_marks(each.text)} for each in facts],
            thought=json.dumps(text, ensure_ascii=False),
            parts=json.dumps([*parts], ensure_ascii=False),
        )
        return [
            Message("system", (self.files.render("role.jinja"),)),
            Message("user", (asked,)),
        ]

    def again(self, problem: str) -> Message:
        """The message after an answer that cannot be used."""
        return Message("user", (self.files.render("again.jinja", problem=problem),))


@lru_cache(maxsize=1)
def load_reader_prompts() -> ReaderPrompts:
    """er-gym's own prompts; they serve thoughts of both languages.

    Raises:
        ValueError: a template is missing or invalid, or Jinja is missing.
    """
    return ReaderPrompts(TemplateFiles.read(config_directory("prompts") / "critic" / "en", _NEEDED))


@dataclass
class Counts:
    """How much of some thoughts was checked, and by whom.

    Attributes:
        thoughts: how many were read.
        true, false, unknown: the sentences by what the rules say; of unknown ones they read no
            claim.
        asked: the thoughts of which the model was asked about some sentence.
        read: the claims in its answers, by verdict.
        unread: of those asked about, the thoughts without an answer in the right form.
        refused: the thoughts that were refused, by who refused them: ``rules``, ``reader``.
    """

    thoughts: int = 0
    true: int = 0
    false: int = 0
    unknown: int = 0
    asked: int = 0
    unread: int = 0
    read: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys(("true", "false", "unknown"), 0)
    )
    refused: dict[str, int] = field(default_factory=lambda: dict.fromkeys(("rules", READER), 0))

    def __str__(self) -> str:
        sentences = self.true + self.false + self.unknown
        lines = [
            f"The critic read {self.thoughts:,} thoughts of {sentences:,} sentences. Its rules "
            f"judged {self.true:,} sentences true and {self.false:,} false, and found no claim "
            f"in {self.unknown:,}; they refused {self.refused['rules']:,} thoughts."
        ]
        if self.asked:
            lines.append(
                f"The model was asked about {self.asked:,} thoughts: "
                f"{', '.join(f'{number:,} claims {name}' for name, number in self.read.items())}; "
                f"{self.unread:,} without a usable answer. It refused "
                f"{self.refused[READER]:,} thoughts."
            )
        return "\n".join(lines)


@dataclass(frozen=True)
class Checked:
    """What was found about a thought.

    Attributes:
        refusals: the reasons to refuse it; those of the model have the code :data:`READER`.
        replies: what the model's replies cost.
    """

    refusals: tuple[Refusal, ...]
    replies: tuple[ModelReply, ...] = ()


class Critic:
    """The critic's rules, and a model for what they leave open. Threads may share one.

    Args:
        client: asks the model; None for the rules alone.

    Attributes:
        counts: of all thoughts that were checked.
    """

    def __init__(self, client: Client | None = None) -> None:
        self._client = client
        self._lock = threading.Lock()
        self.counts = Counts()

    def check(self, text: str, kind: ThoughtKind, known: Knowledge, *, limit: int) -> Checked:
        """Check a thought; the arguments are those of :func:`er_gym.data.critic.check`.

        Args:
            text, kind, known, limit: the thought, and what the agent knew.

        Raises:
            CannotGoOn: the model cannot be asked any more: the budget is spent, the key refused.
        """
        by_rules = review(text, kind, known, limit=limit)
        asks = self._client is not None and not by_rules.refusals and bool(by_rules.open)
        self._count(by_rules, asks)
        if self._client is None or not asks:
            return Checked(by_rules.refusals)
        claims, facts, replies = self._read(self._client, text, by_rules.open, known)
        return Checked(self._refusals(claims, facts), tuple(map(model_reply, replies)))

    def _read(
        self, client: Client, text: str, parts: Sequence[str], known: Knowledge
    ) -> tuple[Sequence[Claim], Mapping[str, Fact], Sequence[Reply]]:
        prompts, facts = load_reader_prompts(), facts_told(known)
        conversation = prompts.conversation(text, parts, facts)
        replies: list[Reply] = []
        by_id = {each.id: each for each in facts}
        for _ in range(TRIES):
            try:
                reply = client.reply(conversation, _SEED)
            except ModelError:  # after all tries, and other requests may succeed
                break
            replies.append(reply)
            try:
                return claims_of(reply), by_id, replies
            except ValueError as error:
                quoted = Message("assistant", (reply.text.strip()[:_LONGEST] or "(nothing)",))
                conversation = [*conversation[:2], quoted, prompts.again(str(error))]
        with self._lock:
            self.counts.unread += 1
        return (), by_id, replies

    def _refusals(self, claims: Sequence[Claim], facts: Mapping[str, Fact]) -> tuple[Refusal, ...]:
        found = []
        with self._lock:
            for each in claims:
                fact = facts.get(each.fact.strip().rstrip("."))
                verdict = each.verdict if fact is not None else "unknown"
                self.counts.read[verdict] += 1
                if verdict == "false" and fact is not None:
                    claim = " ".join(without_marks(each.claim).split())[:_LONGEST]
                    found.append(Refusal(READER, f"“{claim}” is false: {fact.text}"))
            self.counts.refused[READER] += bool(found)
        return tuple(found)

    def _count(self, found: Review, asks: bool) -> None:
        with self._lock:
            counts = self.counts
            counts.thoughts += 1
            counts.asked += asks
            counts.true += found.true
            counts.false += found.false
            counts.unknown += found.unknown
            counts.refused["rules"] += bool(found.refusals)


def claims_of(reply: Reply) -> list[Claim]:
    """The claims in an answer; what stands around its JSON does not count.

    Raises:
        ValueError: it is no JSON in the right form. The message says so to the model.
    """
    text = reply.text[:_LARGEST]
    start, end = text.find("{"), text.rfind("}")
    if start < 0 or end < start:
        raise ValueError("there is no JSON in it.")
    try:
        return Claims.model_validate_json(text[start : end + 1]).claims
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the JSON"
        raise ValueError(f"{where}: {first['msg'][:120]}.") from None
