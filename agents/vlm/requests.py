"""What a request to the model holds: the conversation so far, without what is not sent again.

The agent makes its requests by these rules, and :func:`as_sent` makes them again from a record.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace

from agents.vlm.chat import Message, Picture, Reply
from agents.vlm.history import Limits, pictures_in, with_last_pictures
from agents.vlm.parsing.vocabulary import DECISION
from agents.vlm.prompt_set import Decide
from agents.vlm.record import ConversationRecord, MessageRecord, PictureRecord, RoundRecord
from er_gym.envs.actions import Action
from er_gym.envs.actions import parse as read_action


def said_by(reply: Reply) -> str:
    """The words of a reply, as the conversation has them."""
    return "\n".join(filter(None, (reply.text, reply.call))) or "(nothing)"


def in_form(action: Action | str, decide: Decide) -> Reply:
    """The reply by which a model would decide on an action, without a thought."""
    if isinstance(action, str):
        action = read_action(action) or Action(action)
    fields = json.dumps({"action": action.verb, "object": action.object_type})
    texts = {"tags": f"<{DECISION}>{action}</{DECISION}>", "json": fields, "tools": ""}
    return Reply(texts[decide], call=fields if decide == "tools" else "", finish="")


def as_settings_have_it(
    messages: Sequence[Message], *, in_history: bool, keep: int | None
) -> list[Message]:
    """The messages without regard to limits of the server.

    Args:
        messages: the whole conversation.
        in_history: whether earlier thoughts of a reasoning model are sent back to it.
        keep: how many of the last pictures of earlier turns are sent; None for all.
    """
    found = list(messages)
    if not in_history:
        found = [replace(message, reasoning="") for message in found]
    return found if keep is None else with_last_pictures(found, keep)


def within_limits(
    messages: Sequence[Message], limits: Limits, actions: Mapping[int, str], decide: Decide
) -> list[Message]:
    """The messages within the limits of the server.

    Args:
        messages: as the settings have them.
        limits: none where the whole was sent.
        actions: the action of each reply that had one, by the index of its message.
        decide: how the model says an action.
    """
    if limits == Limits():
        return list(messages)
    short = {place: said_by(in_form(action, decide)) for place, action in actions.items()}
    return limits.applied(messages, short)


def actions_of(rounds: Sequence[RoundRecord]) -> dict[int, str]:
    """The action of each reply that had one, by the index of its message."""
    return {each.message: each.action for each in rounds if each.action}


def as_sent(conversation: ConversationRecord, number: int) -> list[MessageRecord]:
    """The messages of the request that a reply answered.

    A message that was sent without some of its pictures or words is returned so.

    Args:
        conversation: the record.
        number: of the round of the reply, from 0.

    Raises:
        IndexError: there is no such round.
        ValueError: the record does not hold together.
    """
    answered = conversation.rounds[number]
    if not 0 < answered.message < len(conversation.messages):
        raise ValueError(f"round {number} answers no message")
    records = conversation.messages[: answered.message]
    pictures = {
        part.path: part for each in records for part in each.parts if not isinstance(part, str)
    }
    settings = conversation.settings
    whole = as_settings_have_it(
        [
            Message(each.role, tuple(map(_part, each.parts)), reasoning=each.reasoning)
            for each in records
        ],
        in_history=bool(_of(settings, "reasoning").get("in_history", False)),
        keep=_whole_number(_of(settings, "pictures").get("keep")),
    )
    limits = Limits()
    if answered.trimmed is not None:
        left = max(0, pictures_in(whole) - answered.trimmed.pictures)
        limits = Limits(left, max(0, answered.trimmed.messages))
    decide = settings.get("decide")
    sent = within_limits(
        whole,
        limits,
        actions_of(conversation.rounds[:number]),
        decide if decide in ("json", "tools") else "tags",
    )
    return [
        MessageRecord(
            role=each.role,
            parts=[
                part if isinstance(part, str) else pictures[part.data.decode()]
                for part in each.parts
            ],
            reasoning=each.reasoning,
        )
        for each in sent
    ]


def _part(part: str | PictureRecord) -> str | Picture:
    """A part of a message; a picture is known by its path, and its bytes are not read."""
    if isinstance(part, str):
        return part
    return Picture(part.path.encode(), "", part.width, part.height)


def _of(settings: Mapping[str, object], name: str) -> Mapping[str, object]:
    found = settings.get(name)
    return found if isinstance(found, dict) else {}


def _whole_number(value: object) -> int | None:
    return value if isinstance(value, int) else None
