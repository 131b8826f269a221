"""Classifies a failed try: another try follows, the episode fails, or the run ends."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timezone
from email.utils import parsedate_to_datetime
from typing import Literal

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
_ABOUT_ONE_CONVERSATION = re.compile(
    r"context.{0,20}(length|size|window)|too long|longer than|too many (tokens|images)"
    r"|content.(filter|policy|management)|moderation",
    re.IGNORECASE,
)
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
    """

    message: str
    retryable: bool = False
    fatal: str = ""
    timed_out: bool = False
    no_server: bool = False
    retry_after: float | None = None
    server: Literal["", "down", "busy"] = ""


def failure_of(error: openai.OpenAIError, *, key_from: str, answered: bool) -> Failure:
    """Classify an error of the OpenAI SDK.

    Args:
        error: the error of one try.
        key_from: the environment variable of the key.
        answered: whether the server has given a reply before.
    """
    if isinstance(error, openai.APIStatusError):
        return _of_status(error, key_from, answered)
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


def _of_status(error: openai.APIStatusError, key_from: str, answered: bool) -> Failure:
    status, headers = error.status_code, error.response.headers
    said = error_text(error.response.content)
    words = f"{status}, {said}"
    if 300 <= status < 400:
        place = headers.get("location") or "nowhere"
        ends = f"the server redirects to {place}; if the server is there, give its base_url"
        return Failure(words, fatal=ends)
    if _NO_MONEY in (error.code, error.type):
        return Failure(words, fatal="the account of this key has no money left")
    if status in _REFUSED:
        return Failure(words, fatal=_REFUSED[status].format(key_from=key_from))
    about_this = _ABOUT_ONE_CONVERSATION.search(f"{error.code} {said}")
    if status in _MALFORMED and not answered and not about_this:
        return Failure(words, fatal="every request like this will fail")
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
