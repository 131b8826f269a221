"""A client for servers that speak OpenAI's chat completions: OpenAI, Azure, vLLM, Ollama …"""

from __future__ import annotations

import json
import os
import re
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import httpx2
import openai

from agents.base import CannotGoOn
from agents.vlm.chat import Message, ModelError, Reply
from agents.vlm.clients.decision_schema import REQUEST_FIELDS
from agents.vlm.clients.transport import Pace, WholeAnswers
from agents.vlm.clients.wire import read_completion, reply_of, request_body, server_words
from agents.vlm.settings import AgentSettings, Server

OPENAI_URL = "https://api.openai.com/v1"
_SEEDS = 2**31
_LONGEST_WORDS = 400  # characters of a server's, in an error

_REFUSED: Mapping[int, str] = {
    401: "the server does not accept the key of {key_from}",
    402: "the server wants to be paid",
    403: "the server does not let the key of {key_from} do this",
    404: "the server has no such model, or nothing at all at this address",
}
"""What is answered to whatever is asked."""
_MALFORMED = frozenset({400, 405, 415, 422})
"""What is answered to a request that is wrong in itself, such as a parameter that is not known; or
to a single conversation."""
_ABOUT_ONE_CONVERSATION = re.compile(
    r"context.{0,20}(length|size|window)|too long|longer than|too many (tokens|images)"
    r"|content.(filter|policy|management)|moderation",
    re.IGNORECASE,
)


class OpenAIClient:
    """Asks a server. One serves all threads.

    What may pass is tried again, ``settings.server.tries`` times in all, each try
    ``settings.server.timeout`` seconds at most from first to last byte: no connection, 408, 409,
    429, 5xx, and answers that are cut off or empty. Between tries the SDK waits as long as the
    server asks, or half a second, a second, two …

    Args:
        model: its name, as the server knows it; on Azure, the deployment's.
        settings: of the agent.

    Attributes:
        prices: what its replies' costs are worked out by.
        identity: all but the conversation and the episode that a reply depends on, as JSON.

    Raises:
        ValueError: the server's address does not fit.
        CannotGoOn: there is no key, and the server is known to want one.
    """

    def __init__(self, model: str, settings: AgentSettings) -> None:
        self._model, self.prices = model, settings.prices
        self._settings = settings
        server = settings.server
        url = _address(server)
        # As it may be shown: without user, password and query.
        self._where = f"{url.scheme}://{url.netloc.decode()}{url.path}".rstrip("/")
        self._key = _key(server, url)
        self._fields = _fixed_fields(model, settings)
        self._answered = False
        self.identity = json.dumps(
            {"server": self._where, "fields": self._fields, "seed": settings.seed}, sort_keys=True
        )
        pace = Pace(server.requests_per_minute)
        options: dict[str, Any] = {
            # The SDK wants one; without a key the header is left out of every request.
            "api_key": self._key or "none",
            "max_retries": server.tries - 1,
            "timeout": server.timeout,
            "default_headers": {"Accept-Encoding": "identity"},
            "http_client": openai.DefaultHttpxClient(
                transport=WholeAnswers(str(url), server.timeout, read_completion, pace)
            ),
        }
        if server.api_version:
            self._sdk: openai.OpenAI = openai.AzureOpenAI(
                azure_endpoint=str(url),
                azure_deployment=model,
                api_version=server.api_version,
                **options,
            )
        else:
            self._sdk = openai.OpenAI(base_url=url, **options)

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn, as :class:`agents.vlm.chat.Client` has it."""
        began = time.monotonic()
        try:
            response = self._sdk.post(
                "/chat/completions",
                cast_to=httpx2.Response,
                content=self._body(messages, seed),
                options={} if self._key else {"headers": {"Authorization": openai.Omit()}},
            )
        except openai.OpenAIError as error:
            # Not "from error": a server may have repeated the key in what it says.
            raise self._failure(error) from None
        self._answered = True
        reply = reply_of(response.extensions["read"], self.prices)
        return replace(reply, seconds=time.monotonic() - began)

    def close(self) -> None:
        """Close all connections. Whoever still waits gets a ModelError."""
        self._sdk.close()

    def _body(self, messages: Sequence[Message], seed: int) -> bytes:
        fields = self._fields
        if self._settings.seed is not None:
            fields = {**fields, "seed": (self._settings.seed + seed) % _SEEDS}
        return request_body(fields, messages, self._settings.reasoning.in_history)

    # -- errors ----------------------------------------------------------------------------------

    def _failure(self, error: openai.OpenAIError) -> ModelError | CannotGoOn:
        """What to raise for what the SDK gave up on."""
        if isinstance(error, openai.APIStatusError):
            return self._after_status(error)
        cause = error.__cause__ or error
        message = self._line(str(cause), error)
        if isinstance(cause, httpx2.ConnectError) and not self._answered:
            return CannotGoOn(f"{message}; is the server up, and server.base_url right?")
        return ModelError(message)

    def _after_status(self, error: openai.APIStatusError) -> ModelError | CannotGoOn:
        status, words = error.status_code, server_words(error.response.content)
        message = self._line(f"{status}, {words}", error)
        if "insufficient_quota" in (error.code, error.type):
            return CannotGoOn(message)
        if status in _REFUSED:
            meaning = _REFUSED[status].format(key_from=self._settings.server.key_from)
            return CannotGoOn(f"{message}; {meaning}")
        about_this = _ABOUT_ONE_CONVERSATION.search(f"{error.code} {words}")
        if status in _MALFORMED and not self._answered and not about_this:
            return CannotGoOn(f"{message}; no request like this will do better")
        return ModelError(message)

    def _line(self, words: str, error: openai.OpenAIError) -> str:
        """One line that says who, what, and how often tried; never the key."""
        if self._key:
            words = words.replace(self._key, "***")  # whole, so before anything is cut off
        words = " ".join(words.split())
        if len(words) > _LONGEST_WORDS:
            words = words[:_LONGEST_WORDS] + "…"
        request = getattr(error, "request", None)
        tries = 1 + int(request.headers.get("x-stainless-retry-count", 0)) if request else 1
        often = f" (tried {tries} times)" if tries > 1 else ""
        return f"{self._model} at {self._where}: {words}{often}"


def _address(server: Server) -> httpx2.URL:
    if server.api_version and not server.base_url:
        raise ValueError(
            "server.api_version says that the server is Azure's; give server.base_url too, such as "
            "https://NAME.openai.azure.com"
        )
    given = server.base_url or OPENAI_URL
    try:
        url = httpx2.URL(given)
    except httpx2.InvalidURL:
        url = httpx2.URL("")
    if url.scheme not in ("http", "https") or not url.host:
        without_user = given.rpartition("@")[2]
        raise ValueError(
            f"server.base_url {without_user!r} is no address; give one such as "
            "http://127.0.0.1:8000/v1"
        )
    return url


def _key(server: Server, url: httpx2.URL) -> str:
    """The key; "" if there is none and the server may do without."""
    key = os.environ.get(server.key_from, "").strip()
    if not (key.isascii() and key.isprintable()):
        raise CannotGoOn(f"{server.key_from} holds characters that are in no key; set it anew")
    openais_own = url.host == httpx2.URL(OPENAI_URL).host
    if not key and (openais_own or server.api_version):
        raise CannotGoOn(
            f"there is no key: set {server.key_from}, or give server.base_url of a server that "
            "needs none"
        )
    return key


def _fixed_fields(model: str, settings: AgentSettings) -> dict[str, Any]:
    """All fields of a request but the messages and the seed.

    ``extra`` overrules them, and a null in it leaves one out: some models take no temperature.
    """
    sampling, server = settings.sampling, settings.server
    effort = settings.reasoning.effort
    fields = {
        "model": model,
        "temperature": sampling.temperature,
        "top_p": sampling.top_p,
        server.max_tokens_field: sampling.max_tokens,
        **({"reasoning_effort": effort} if effort else {}),
        **REQUEST_FIELDS[settings.decide],
        **server.extra,
    }
    return {name: value for name, value in fields.items() if value is not None}
