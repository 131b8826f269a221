"""Classifies a failed try: another try follows, the episode fails, or the run ends."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timezone
from email.utils import parsedate_to_datetime
from typing import Literal, TypeAlias

import httpx2
import openai

from agents.vlm.clients.chat_completions import error_text

_TOO_MANY = 429
_MAY_PASS = frozenset({408, 409, 425, _TOO_MANY})  # and all from 500 on
_REFUSED: Mapping[int, str] = {
    401: "the server does not accept the key of {key_from}",
    402: "the server demands payment",
    403: "the server does not allow the key of {key_from} to do this",
    404: "the server has no such model, or nothing at all at this address",
}
"""Statuses that every request would get."""
_MALFORMED = frozenset({400, 405, 415, 422})
"""Statuses for a request that is invalid, for example with an unknown parameter; or for a single
conversation."""
Refusal: TypeAlias = Literal["", "context", "pictures", "content", "request"]
_SAID_OF: Mapping[Refusal, tuple[str, ...]] = {
    "pictures": (
        r"(?:too many|exceed\w*|maximum|max|at most|up to|more than|limit|only)\b.{0,60}"
        r"\b(?:images?|pictures?|image_url|multimodal|mm)\b",
        r"\b(?:images?|pictures?)\b.{0,60}(?:too many|exceed|limit|at most|maximum)",
        r"limit.mm.per.prompt",
        r"图片.{0,20}(?:过多|超过|超出|上限|限制)",
    ),
    "content": (
        r"content.{0,2}(?:filter|policy|policies|management|violation)|moderation|flagged",
        r"data_inspection_failed|inappropriate content|responsible.?ai|safety system",
        r"considered high risk|sensitive (?:content|words?)|prohibited.content|usage polic",
        r"违规|敏感|不安全|不当内容",
    ),
    "context": (
        r"context.{0,20}(?:length|size|window|limit|overflow)|exceed_context_size",
        r"context_length_exceeded|string_above_max_length",
        r"(?:prompt|input|request|conversation|messages?|text).{0,30}"
        r"too (?:long|large|big)\b",
        r"longer than|too many (?:input |prompt |total )?tokens|request_too_large",
        r"(?:entity|payload|body).{0,10}too large|maximum request body",
        r"tokens?\b.{0,60}\bexceed|\bexceed\w*.{0,60}\b(?:tokens?|length|limit of \d)",
        r"reduce the (?:length|size|number)|max_new_tokens.{0,4} must be|must be <= \d+",
        r"range of input length|max(?:imum)?_?(?:model|input|seq\w*).{0,5}len",
        r"(?:超长|过长|超过.{0,12}(?:长度|上限|限制)|超出.{0,12}(?:长度|上限|限制))",
    ),
}
"""What servers say of one conversation, by kind; the first kind that fits counts. The words are of
OpenAI, Azure, Anthropic, Gemini, DashScope, Zhipu, Moonshot, Mistral, Groq, OpenRouter, vLLM,
SGLang, TGI, llama.cpp, Ollama and LM Studio."""
_REFUSALS = tuple(
    (kind, re.compile("|".join(words), re.IGNORECASE)) for kind, words in _SAID_OF.items()
)
_TOO_LARGE = 413
_FORBIDDEN, _BROKEN = 403, 500
_ONE_TOO_LARGE = re.compile(r"request too large", re.IGNORECASE)
"""Said with 429 by servers that limit the tokens of a minute, where one request has more."""
_LONGEST_SAID = 4_000
_NO_MONEY = "insufficient_quota"


@dataclass(frozen=True)
class Failure:
    """How a try failed.

    Attributes:
        message: what happened, as the server or the connection says it.
        retryable: whether another try may succeed.
        fatal: why no later request can succeed; "" if one can.
        timed_out: whether the time limit was reached.
        no_server: whether no server seems to be there: neither this try nor any before it got an
            answer.
        retry_after: seconds that the server asks to wait; None if it does not ask.
        server: what it says about the server, where another may do better: ``down``: no
            connection, no answer in time, or 5xx; ``busy``: it asks to wait; "" for nothing.
        refuses: why no later try of this conversation can succeed, while others may: it is too long
            for the ``context``, has too many ``pictures``, its ``content`` is refused, or, for an
            unknown reason, the ``request``; "" if one can.
        known: whether the server says so in so many words; otherwise it may refuse every request.
    """

    message: str
    retryable: bool = False
    fatal: str = ""
    timed_out: bool = False
    no_server: bool = False
    retry_after: float | None = None
    server: Literal["", "down", "busy"] = ""
    refuses: Refusal = ""
    known: bool = False


def failure_of(error: openai.OpenAIError, *, key_from: str, answered: bool) -> Failure:
    """Classify an error of the OpenAI SDK.

    Args:
        error: the error of one try.
        key_from: the environment variable of the key.
        answered: whether the server has given a reply before.
    """
    if isinstance(error, openai.APIStatusError):
        return _of_status(error, key_from)
    cause = error.__cause__ or error
    words = str(cause) or type(cause).__name__
    if not isinstance(cause, httpx2.RequestError):
        return Failure(words)
    late = isinstance(cause, httpx2.ReadTimeout)
    alone = late or isinstance(cause, (httpx2.ConnectError, httpx2.ConnectTimeout))
    return Failure(
        words,
        retryable=True,
        timed_out=late,
        no_server=alone and not answered,
        server="down" if isinstance(cause, httpx2.TransportError) else "",
    )


def _of_status(error: openai.APIStatusError, key_from: str) -> Failure:
    status, headers = error.status_code, error.response.headers
    said = error_text(error.response.content)
    words = f"{status}, {said}"
    if 300 <= status < 400:
        place = headers.get("location") or "nowhere"
        ends = f"the server redirects to {place}; if the server is there, give its base_url"
        return Failure(words, fatal=ends)
    if _NO_MONEY in (error.code, error.type):
        return Failure(words, fatal="the account of this key has no money left")
    kind = refusal_of(f"{error.code} {error.type} {said}")
    if status == _FORBIDDEN and kind == "content":
        return Failure(words, refuses=kind)
    if status in _REFUSED:
        return Failure(words, fatal=_REFUSED[status].format(key_from=key_from))
    if status == _TOO_LARGE:
        return Failure(words, refuses=kind or "context", known=True)
    if status in _MALFORMED:
        return Failure(words, refuses=kind or "request", known=bool(kind))
    too_long = kind in ("context", "pictures") and status == _BROKEN
    if too_long or (status == _TOO_MANY and _ONE_TOO_LARGE.search(said)):
        return Failure(words, refuses=kind or "context")
    passes = status in _MAY_PASS or status >= 500
    asked_to = headers.get("x-should-retry") != "false"
    wait = requested_pause(headers)
    busy = status == _TOO_MANY or (status >= 500 and wait is not None)
    return Failure(
        words,
        retryable=passes and asked_to,
        retry_after=wait,
        server="busy" if busy else "down" if status >= 500 and asked_to else "",
    )


def refusal_of(said: str) -> Refusal:
    """The kind of a refusal of one conversation, from a server's words; "" for none."""
    found = (kind for kind, words in _REFUSALS if words.search(said[:_LONGEST_SAID]))
    return next(found, "")


def requested_pause(headers: httpx2.Headers) -> float | None:
    """The seconds that a server asks to wait, possibly infinite; None without a valid future
    time."""
    text = headers.get("retry-after", "")
    for name, scale in (("retry-after-ms", 0.001), ("retry-after", 1.0)):
        try:
            seconds = float(headers.get(name, "")) * scale
        except ValueError:
            continue
        return seconds if seconds > 0 else None
    try:
        then = parsedate_to_datetime(text)
        if then.tzinfo is None:
            then = then.replace(tzinfo=timezone.utc)
        seconds = then.timestamp() - time.time()
    except (TypeError, ValueError, OverflowError, IndexError):
        return None
    return seconds if 0 < seconds <= math.inf else None
