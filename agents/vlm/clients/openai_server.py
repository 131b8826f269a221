"""A client for servers that speak OpenAI's chat completions: OpenAI, Azure, vLLM, Ollama …"""

from __future__ import annotations

import itertools
import json
import math
import os
import random
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import httpx2
import openai

from agents.vlm.chat import Message, Reply
from agents.vlm.clients.budget import Budget, Entry, Ledger
from agents.vlm.clients.chat_completions import (
    billed_usage,
    cost_of,
    picture_bytes,
    read_billing,
    read_completion,
    reply_of,
    request_body,
)
from agents.vlm.clients.decision_schema import REQUEST_FIELDS
from agents.vlm.clients.failures import Failure, failure_of
from agents.vlm.clients.redaction import RedactingLogFilter, Secrets
from agents.vlm.clients.supervisor import AGAIN, Request, RequestSupervisor, duration
from agents.vlm.clients.tokens import RequestSize
from agents.vlm.clients.transport import BoundedTransport, RateLimiter
from agents.vlm.settings import AgentSettings, Server
from er_gym.rollout.agent import CannotGoOn

OPENAI_URL = "https://api.openai.com/v1"
_SEEDS = 2**31
_LONGEST_WORDS = 400  # characters of a server's, in an error
_FIRST_PAUSE, _LONGEST_PAUSE = 0.5, 8.0  # seconds before another try, where the server states none
_LONGEST_ASKED = 120.0
"""Seconds that a server may ask to wait; for more, the run has to have minutes left."""
_SEE_TO_IT = (
    "nothing has answered yet: check that the server is up and server.base_url is right, or raise "
    "server.timeout"
)
_LATE_TRIES = 2
"""The most tries of a request that times out: a server may charge for an answer that came too late.
"""


class OpenAIClient:
    """Asks a server over HTTP. All threads share one client.

    Failures that may pass are tried again, up to ``settings.server.tries`` tries in all: no
    connection, 408, 409, 425, 429, 5xx, and answers that are cut off or empty. Each try takes at
    most ``settings.server.timeout`` seconds from first to last byte. Between tries the client waits
    as long as the server asks, or half a second, one second, two … Each failed try is reported to
    ``supervisor``. An answer with status 2xx is entered in the ledger before it is checked.

    Args:
        model: the model's name on the server; on Azure, the deployment's name.
        settings: the agent's settings.
        ledger: the run's ledger; by default nothing is recorded or limited.
        supervisor: the run's request supervisor; by default without limit.

    Attributes:
        prices: the prices for the cost of replies.
        identity: everything that a reply depends on besides conversation and episode, as JSON. The
            server's port does not count.

    Raises:
        ValueError: the server's address is invalid.
        CannotGoOn: there is no key, and the server is known to need one.
    """

    def __init__(
        self,
        model: str,
        settings: AgentSettings,
        ledger: Ledger | None = None,
        supervisor: RequestSupervisor | None = None,
    ) -> None:
        self._model, self.prices = model, settings.prices
        self._settings = settings
        self._ledger = ledger or Ledger(Budget(), settings.prices)
        self._supervisor = supervisor or RequestSupervisor()
        server = settings.server
        url = _address(server)
        # For messages: without user, password and query.
        self._where = f"{url.scheme}://{url.netloc.decode()}{url.path}".rstrip("/")
        self._key = _key(server, url)
        self._secrets = Secrets(self._key, str(url))
        self._logs = RedactingLogFilter(self._secrets)
        self._fields = _fixed_fields(model, settings)
        self._answered = False
        place = f"{url.scheme}://{url.host}{url.path}".rstrip("/")
        self.identity = json.dumps(
            {"server": place, "fields": self._fields, "seed": settings.seed}, sort_keys=True
        )
        self._rate_limiter = RateLimiter(server.requests_per_minute)
        self._transport = BoundedTransport(url, server.timeout, server.connect)
        plain = url.copy_with(query=None, fragment=None)
        options: dict[str, Any] = {
            # The SDK needs a value; without a key the header is removed from every request.
            "api_key": self._key or "none",
            "max_retries": 0,  # its waits can be neither reported nor ended
            "timeout": server.timeout,
            "default_headers": {"Accept-Encoding": "identity"},
            # A redirect may lead to another party, which would get the pictures.
            "http_client": openai.DefaultHttpxClient(
                transport=self._transport, follow_redirects=False
            ),
        }
        if server.api_version:
            self._sdk: openai.OpenAI = openai.AzureOpenAI(
                azure_endpoint=str(plain),
                azure_deployment=model,
                api_version=server.api_version,
                **options,
            )
        else:
            self._sdk = openai.OpenAI(base_url=plain, **options)

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn, as :class:`agents.vlm.chat.Client` has it."""
        body = self._body(messages, seed)
        request_size = RequestSize.of(body, messages, picture_bytes(messages), self._fields)
        request = self._supervisor.request(seed)
        request.of = self._settings.server.tries
        late = 0
        for request.attempt in itertools.count(1):
            self._check(request)
            answer = self._try(body, request_size, request)
            if isinstance(answer, Reply):
                self._answered = True
                request.answered()
                return replace(answer, seconds=time.monotonic() - request.began)
            what = self._line(answer)
            if answer.fatal:
                raise self._supervisor.stop(self._with_tries(what, request))
            late += answer.timed_out
            if not answer.retryable or request.attempt == request.of or late == _LATE_TRIES:
                what = self._with_tries(what, request)
                if answer.no_server:
                    raise self._supervisor.stop(f"{what}; {_SEE_TO_IT}, and {AGAIN}")
                raise request.gave_up(what)
            self._pause(answer, what, request)
        raise AssertionError("unreachable")

    def close(self) -> None:
        """Close all connections. Waiting callers get a ModelError."""
        self._supervisor.close()
        self._sdk.close()
        self._logs.close()

    def _body(self, messages: Sequence[Message], seed: int) -> bytes:
        fields = self._fields
        if self._settings.seed is not None:
            fields = {**fields, "seed": (self._settings.seed + seed) % _SEEDS}
        return request_body(fields, messages, self._settings.reasoning.in_history)

    # -- one try -----------------------------------------------------------------------------------

    def _check(self, request: Request) -> None:
        """Wait for the rate limit and check the budget; raises CannotGoOn if it is spent."""
        self._rate_limiter.wait(request)
        try:
            self._ledger.check()
        except CannotGoOn as error:
            # Answers under way are paid for and awaited; no thread tries again.
            self._supervisor.stop(str(error), waits_for_answers=True)
            raise

    def _try(self, body: bytes, request_size: RequestSize, request: Request) -> Reply | Failure:
        """A reply or a failure. A failure is returned, not raised: an exception that may hold the
        key must not become the context of another."""
        began = time.monotonic()
        self._transport.begin_try(request)
        answer: httpx2.Response | openai.OpenAIError
        try:
            answer = self._sdk.post(
                "/chat/completions",
                cast_to=httpx2.Response,
                content=body,
                options={} if self._key else {"headers": {"Authorization": openai.Omit()}},
            )
        except openai.OpenAIError as error:
            answer = error
        except BaseException:  # the run ends, or Ctrl-C
            if request.answering:
                self._enter(b"", request_size, None, "the run has ended", request, began)
            raise
        if isinstance(answer, openai.OpenAIError):
            failure = failure_of(
                answer, key_from=self._settings.server.key_from, answered=self._answered
            )
            if request.answering:
                self._enter(b"", request_size, None, failure.message, request, began)
            return failure
        try:
            said, rejected = reply_of(read_completion(answer.content)), ""
        except ValueError as error:
            said, rejected = None, str(error)
        reply = self._enter(answer.content, request_size, said, rejected, request, began)
        return reply or Failure(rejected, retryable=True)

    def _enter(
        self,
        body: bytes,
        request_size: RequestSize,
        said: Reply | None,
        rejected: str,
        request: Request,
        began: float,
    ) -> Reply | None:
        """Enter an answer's cost in the ledger; return the reply with its cost and without
        secrets."""
        model, usage = billed_usage(read_billing(body), request_size, said)
        cost, model = cost_of(usage, self.prices), self._secrets.redact(model)
        self._ledger.enter(
            Entry.of(
                usage,
                model=model,
                seed=request.seed,
                cost=cost,
                seconds=time.monotonic() - began,
                rejected=self._plain(rejected),
            )
        )
        if said is None:
            return None
        redact = self._secrets.redact
        return replace(
            said,
            text=redact(said.text),
            reasoning=redact(said.reasoning),
            call=redact(said.call),
            finish=redact(said.finish),
            model=model,
            usage=usage,
            cost=cost,
        )

    # -- between tries -----------------------------------------------------------------------------

    def _pause(self, failure: Failure, what: str, request: Request) -> None:
        """Report the failure and wait; raises CannotGoOn if the wait would be too long."""
        growing = min(_LONGEST_PAUSE, _FIRST_PAUSE * 2.0 ** min(request.attempt - 1, 10))
        pause = failure.retry_after or growing * random.uniform(0.75, 1.0)
        left = request.left()
        if pause > left:
            raise self._supervisor.stop(
                f"{what}; the server asks to wait {duration(pause)}, and {duration(left)} of "
                f"--max-minutes are left; {AGAIN}"
                if failure.retry_after
                else f"{what}; the minutes of --max-minutes are over; {AGAIN}"
            )
        if pause > _LONGEST_ASKED and math.isinf(left):
            raise self._supervisor.stop(
                f"{what}; the server asks to wait {duration(pause)}: {AGAIN} after that, or give "
                "a higher --max-minutes, and er-gym waits"
            )
        of = min(request.of, request.attempt + 1) if failure.timed_out else request.of
        request.retry(what, pause, of)
        request.wait(pause)

    def _line(self, failure: Failure) -> str:
        """One line with model, address and failure, without the key."""
        words = self._plain(failure.message)
        ends = f"; {self._plain(failure.fatal)}" if failure.fatal else ""
        return f"{self._model} at {self._where}: {words}{ends}"

    def _plain(self, words: str) -> str:
        """Short, printable, in one line and without secrets."""
        words = self._secrets.redact(
            words
        )  # before the text is cut, so that no part of a secret stays
        words = " ".join("".join(c if c.isprintable() else " " for c in words).split())
        return words if len(words) <= _LONGEST_WORDS else words[:_LONGEST_WORDS] + "…"

    @staticmethod
    def _with_tries(what: str, request: Request) -> str:
        return f"{what} (tried {request.attempt} times)" if request.attempt > 1 else what


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
    is_port = url.port is None or 0 < url.port < 1 << 16
    if url.scheme not in ("http", "https") or not url.host or not is_port:
        without_user = given.rpartition("@")[2].partition("?")[0]
        raise ValueError(
            f"server.base_url {without_user!r} is not an address; give one such as "
            "http://127.0.0.1:8000/v1"
        )
    return url


def _key(server: Server, url: httpx2.URL) -> str:
    """The API key; "" if there is none and the server may not need one."""
    key = os.environ.get(server.key_from, "").strip()
    if not (key.isascii() and key.isprintable()):
        raise CannotGoOn(f"{server.key_from} holds characters that no key contains; set it again")
    openais_own = url.host == httpx2.URL(OPENAI_URL).host
    if not key and (openais_own or server.api_version):
        raise CannotGoOn(
            f"there is no key: set {server.key_from}, or give server.base_url of a server that "
            "needs none"
        )
    return key


def _fixed_fields(model: str, settings: AgentSettings) -> dict[str, Any]:
    """All fields of a request but the messages and the seed.

    ``extra`` overrides them, and a null in it removes a field: some models accept no temperature.
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
