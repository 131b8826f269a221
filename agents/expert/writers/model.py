"""A writer that asks a model for the thoughts; the critic checks them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from agents.expert.writers.base import ThoughtRequest, ThoughtWriter, WrittenThoughts
from agents.expert.writers.prompts import WriterPrompts
from agents.expert.writers.reader import Critic
from agents.expert.writers.registry import checked_grounded
from agents.expert.writers.replies import (
    NO_REPLY,
    EchoCheck,
    codes_of,
    quoted,
    read_thought,
)
from agents.vlm.chat import Client, Message, ModelError, Reply, model_reply
from agents.vlm.pictures import within_bounds
from agents.vlm.settings import AgentSettings
from er_gym.data.critic import Refusal
from er_gym.data.trajectory import ThoughtRecord
from er_gym.rollout.agent import ModelReply

TRIES = 3
"""A thought is asked for this often: once, and twice again with the reasons."""


class ModelWriter:
    """Asks a model for all thoughts of a turn in one request.

    A thought that the critic refuses is asked for again with the reasons, at most twice. After that
    the fallback writes it. The record then names the fallback as its writer and keeps the codes of
    the refusals.

    Args:
        name: of the model, such as ``openai:MODEL``.
        client: asks it.
        settings: of the client; ``sees`` says whether it is sent pictures.
        prompts: what it is told.
        fallback: writes what the model does not; by default the grounded writer, checked by the
            critic.
        critic: checks the model's thoughts; by default the rules alone.

    Raises:
        ValueError: the settings ask for another form of replies than tags.
    """

    def __init__(
        self,
        name: str,
        client: Client,
        settings: AgentSettings,
        prompts: WriterPrompts,
        fallback: ThoughtWriter | None = None,
        critic: Critic | None = None,
    ) -> None:
        check_settings(settings)
        self.name = name
        self._client, self._settings, self._prompts = client, settings, prompts
        self._fallback = fallback or checked_grounded()
        self._critic = critic or Critic()

    def write(self, request: ThoughtRequest) -> WrittenThoughts:
        """Write the thoughts of a turn; see :class:`~agents.expert.writers.base.ThoughtWriter`.

        Raises:
            CannotGoOn: no later request can succeed: the budget is spent, the key refused.
        """
        shown = request.pictures if self._settings.sees == "pictures" else ()
        pictures = [within_bounds(each, self._settings.pictures) for each in shown]
        conversation = [self._prompts.role(), self._prompts.turn(request, pictures)]
        drafts = _Drafts(request, self._prompts.echo_check, self._critic)
        replies: list[ModelReply] = []
        for attempt in range(TRIES):
            try:
                reply = self._client.reply(conversation, request.seed)
            except ModelError:  # after all tries, and other requests may succeed
                drafts.no_reply()
                break
            replies.append(model_reply(reply))
            problems = drafts.take(reply)
            if not problems:
                break
            if attempt + 1 < TRIES:
                conversation += [
                    Message("assistant", (quoted(reply),)),
                    self._prompts.again(request, problems),
                ]
        return WrittenThoughts(self._records(request, drafts), (*replies, *drafts.asked))

    def _records(self, request: ThoughtRequest, drafts: _Drafts) -> tuple[ThoughtRecord, ...]:
        """The model's thoughts, and the fallback's where there is none that can stand."""
        others: Sequence[ThoughtRecord] = ()
        if drafts.open:
            others = self._fallback.write(request).thoughts
        return tuple(
            others[index].model_copy(update={"refused": drafts.refused[index]})
            if index in drafts.open
            else ThoughtRecord(
                kind=kind,
                text=drafts.texts[index],
                writer=self.name,
                refused=drafts.refused[index],
            )
            for index, kind in enumerate(request.kinds)
        )


def check_settings(settings: AgentSettings) -> None:
    """Check that a client with these settings can write thoughts.

    Raises:
        ValueError: it would be asked for another form of replies than tags.
    """
    if settings.decide != "tags":
        raise ValueError(
            f"decide is {settings.decide!r}, but thoughts are written in tags: leave decide out"
        )


@dataclass
class _Drafts:
    """The thoughts of a turn as far as they stand.

    Attributes:
        request: the turn.
        echo_check: checks that the model does not repeat its prompt.
        critic: checks what it says.
        asked: what the critic's model replied.
        texts: the thoughts that stand, by index.
        refused: the codes of the refusals of each thought, by index.
    """

    request: ThoughtRequest
    echo_check: EchoCheck
    critic: Critic
    asked: list[ModelReply] = field(default_factory=list)
    texts: dict[int, str] = field(default_factory=dict)
    refused: dict[int, list[str]] = field(init=False)

    def __post_init__(self) -> None:
        self.refused = {index: [] for index in range(len(self.request.kinds))}

    @property
    def open(self) -> list[int]:
        """The indices of the thoughts that are missing."""
        return [index for index in self.refused if index not in self.texts]

    def take(self, reply: Reply) -> dict[int, list[str]]:
        """Take what can stand of a reply; returns the reasons against the rest, by index."""
        problems: dict[int, list[str]] = {}
        for index in self.open:
            refusals = self._read(reply, index)
            if refusals:
                self.refused[index] += codes_of(refusals)
                problems[index] = [each.detail for each in refusals]
        return problems

    def no_reply(self) -> None:
        """Note that the last request had no reply."""
        for index in self.open:
            self.refused[index].append(NO_REPLY)

    def _read(self, reply: Reply, index: int) -> Sequence[Refusal]:
        """The reasons against a thought; without any, it is among the texts from now on."""
        kind, limit = self.request.kinds[index], self.request.limits[index]
        found = read_thought(reply, kind, limit)
        if found.refusals:
            return found.refusals
        known = self.request.knowledge
        # What was thought at this turn may not be thought again at it, either.
        now = [
            ThoughtRecord(kind=self.request.kinds[each], text=text)
            for each, text in self.texts.items()
        ]
        known = replace(known, earlier=[*known.earlier, now])
        checked = self.critic.check(found.text, kind, known, limit=limit)
        self.asked += checked.replies
        refusals = (*self.echo_check.refusals(found.text), *checked.refusals)
        if not refusals:
            self.texts[index] = found.text
        return refusals
