"""OpenAI's chat completion format: encodes a conversation as a request and decodes a reply."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

from pydantic import Field, ValidationError

from agents.vlm.chat import Message, Picture, Reply, Usage
from agents.vlm.clients.tokens import ReportedUsage, RequestSize, usage_of
from agents.vlm.clients.tolerant_model import OrNone, TolerantModel
from agents.vlm.settings import Prices
from er_gym.tasks.errors import first_problem

_LONGEST_WORD = 200  # characters of a model's name, or of why it stopped
_LONGEST_ERROR = 100_000  # bytes of an error that are read

# Each turn sends the whole conversation again: a picture is base64-encoded once and freed together
# with the conversation.
_ENCODED: WeakKeyDictionary[Picture, bytes] = WeakKeyDictionary()


# -- requests --------------------------------------------------------------------------------------


def picture_bytes(messages: Sequence[Message]) -> int:
    """The bytes that a conversation's pictures take in a request."""
    return sum(
        len(_picture(part)) for each in messages for part in each.parts if isinstance(part, Picture)
    )


def request_body(
    fields: Mapping[str, Any], messages: Sequence[Message], with_reasoning: bool
) -> bytes:
    """A request as JSON; equal requests give equal bytes.

    It is joined from encoded parts: the SDK's typed request takes ten times as long for a
    conversation with 20 pictures.

    Args:
        fields: all fields but the messages; at least one.
        messages: the conversation.
        with_reasoning: whether earlier thoughts are sent back.
    """
    head = json.dumps(fields).encode()[:-1]
    turns = b",".join(_message(message, with_reasoning) for message in messages)
    return b'%b,"messages":[%b]}' % (head, turns)


def _message(message: Message, with_reasoning: bool) -> bytes:
    thoughts = message.reasoning if with_reasoning and message.role == "assistant" else ""
    more = b',"reasoning_content":%b' % _text(thoughts) if thoughts else b""
    return b'{"role":"%b","content":%b%b}' % (message.role.encode(), _content(message), more)


def _content(message: Message) -> bytes:
    if any(isinstance(part, Picture) for part in message.parts):
        return b"[%b]" % b",".join(map(_part, message.parts))
    return _text("\n".join(part for part in message.parts if isinstance(part, str)))


def _part(part: str | Picture) -> bytes:
    if isinstance(part, Picture):
        return _picture(part)
    return b'{"type":"text","text":%b}' % _text(part)


def _text(text: str) -> bytes:
    return json.dumps(text).encode()


def _picture(picture: Picture) -> bytes:
    done = _ENCODED.get(picture)
    if done is None:
        head, letters = picture.media_type.encode(), base64.b64encode(picture.data)
        url = b'{"type":"image_url","image_url":{"url":"data:%b;base64,%b"}}'
        done = _ENCODED[picture] = url % (head, letters)
    return done


# -- answers ---------------------------------------------------------------------------------------


class _Function(TolerantModel):
    arguments: OrNone[str] = None


class _ToolCall(TolerantModel):
    function: OrNone[_Function] = None


class _AssistantMessage(TolerantModel):
    content: str | None = None
    refusal: OrNone[str] = None
    reasoning_content: OrNone[str] = None  # vLLM, SGLang, DeepSeek
    reasoning: OrNone[str] = None  # Ollama, OpenRouter, later vLLM
    tool_calls: OrNone[tuple[_ToolCall, ...]] = None


class _Choice(TolerantModel):
    message: _AssistantMessage
    finish_reason: OrNone[str] = None


class Completion(TolerantModel):
    """The fields of a server's answer that er-gym reads."""

    choices: tuple[_Choice, ...] = Field(min_length=1)


class Billing(TolerantModel):
    """The billing fields of an answer, which an invalid reply may have too."""

    model: OrNone[str] = None
    usage: OrNone[ReportedUsage] = None


def read_completion(body: bytes) -> Completion:
    """Parse the body of an answer.

    Raises:
        ValueError: the body is not JSON or has no choice; the message is one line.
    """
    try:
        return Completion.model_validate_json(body)
    except ValidationError as error:
        problem = first_problem(error, "the body")
        raise ValueError(f"{problem}; it says: {error_text(body)}") from None


def read_billing(body: bytes) -> Billing:
    """The billing fields of a body; empty if it is not JSON."""
    try:
        return Billing.model_validate_json(body)
    except ValidationError:
        return Billing()


def reply_of(completion: Completion) -> Reply:
    """The reply of an answer. A refusal counts as a reply with its words as text."""
    choice = completion.choices[0]
    said = choice.message
    thought, text = _without_thoughts(said.content or said.refusal or "")
    calls = [call.function for call in said.tool_calls or () if call.function]
    return Reply(
        text=text,
        reasoning="\n".join(filter(None, (said.reasoning_content or said.reasoning, thought))),
        call=(calls[0].arguments or "") if calls else "",
        finish=(choice.finish_reason or "")[:_LONGEST_WORD],
        refused=bool(said.refusal) and not said.content,
    )


def billed_usage(
    bill: Billing, request_size: RequestSize, reply: Reply | None
) -> tuple[str, Usage]:
    """The model that answered, and the billed tokens, never too low.

    Args:
        bill: the billing fields of the answer.
        request_size: the size of the request.
        reply: the reply; None if the answer has no valid one.
    """
    said, cut = None, False
    if reply is not None:
        said = sum(len(each.encode()) for each in (reply.text, reply.reasoning, reply.call))
        cut = reply.finish == "length"
    return (bill.model or "")[:_LONGEST_WORD], usage_of(bill.usage, request_size, said, cut)


def _without_thoughts(text: str) -> tuple[str, str]:
    """The thoughts at the beginning of a text, and the rest.

    The opening tag may be missing, since some templates put it into the prompt. The closing tag may
    be missing if the thoughts were cut off.
    """
    before, closed, after = text.partition("</think>")
    opened = before.lstrip().startswith("<think>")
    if opened or (closed and "<think>" not in before):
        return before.strip().removeprefix("<think>").strip(), after.strip()
    return "", text


def cost_of(usage: Usage, prices: Prices) -> float:
    """The cost in US dollars. Reasoning tokens are part of the completion, cached tokens of the
    prompt."""
    remembered = prices.prompt if prices.cached_prompt is None else prices.cached_prompt
    fresh = usage.prompt - usage.cached
    paid = fresh * prices.prompt + usage.cached * remembered + usage.completion * prices.completion
    return paid / 1_000_000


def error_text(body: bytes) -> str:
    """The error message in the body of an answer, in one line."""
    try:
        said = json.loads(body if len(body) <= _LONGEST_ERROR else "")
    except (ValueError, RecursionError):
        said = body[:_LONGEST_ERROR].decode("utf-8", "replace")
    for name in ("error", "message", "detail"):
        if isinstance(said, dict) and said.get(name):
            said = said[name]
    return " ".join(str(said).split()) or "(nothing)"
