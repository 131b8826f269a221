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
from functools import partial
from typing import Any

import httpx2
import openai

from agents.vlm.chat import ConversationRefused, Message, Picture, Reply
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
from agents.vlm.clients.endpoint import OPENAI_URL, Endpoint, addresses
from agents.vlm.clients.endpoints import Endpoints, Use
from agents.vlm.clients.failures import Failure, failure_of
from agents.vlm.clients.supervisor import AGAIN, Request, RequestSupervisor, duration
from agents.vlm.clients.tokens import RequestSize
from agents.vlm.redaction import RedactingLogFilter, Secrets
from agents.vlm.settings import AgentSettings, Server
from er_gym.rollout.agent import CannotGoOn

_SEEDS = 2**31
_LONGEST_WORDS = 400  # characters of a server's, in an error
_FIRST_PAUSE, _LONGEST_PAUSE = 0.5, 8.0  # seconds before another try, where the server states none
_LONGEST_ASKED = 120.0
"""Seconds that a server may ask to wait; for more, the run has to have minutes left."""
_SEE_TO_IT = (
    "nothing has answered yet: check that the server is up and server.base_url is right, or raise "
    "server.timeout"
)
_PROBE = "Say OK."
"""What a server is asked where it is not clear whether it fails or this conversation does."""
_LATE_TRIES = 2
"""The most tries of a request that times out: a server may charge for an answer that came too late.
"""


class OpenAIClient:
    """Asks a server over HTTP, or several with the same model. All threads share one client.

    Failures that may pass are tried again, up to ``settings.server.tries`` tries in all: no
    connection, 408, 409, 425, 429, 5xx, and answers that are cut off or empty. Each try takes at
    most ``settings.server.timeout`` seconds from first to last byte. Between tries the client waits
    as long as the server asks, or half a second, one second, two …; if another server is there, it
    is asked without a wait (:class:`agents.vlm.clients.endpoints.Endpoints`). Where it is not clear
    whether the server fails or one conversation does, a short conversation shows it: a server that
    answers that one does not stop the run. Each failed try is
    reported to ``supervisor``. An answer with status 2xx is entered in the ledger before it is
    checked.

    Args:
        model: the model's name on the server; on Azure, the deployment's name.
        settings: the agent's settings.
        ledger: the run's ledger; by default nothing is recorded or limited.
        supervisor: the run's request supervisor; by default without limit.

    Attributes:
        prices: the prices for the cost of replies.
        identity: everything that a reply depends on besides conversation and episode, as JSON. Of
            several servers, the first stands for all. The server's port does not count.

    Raises:
        ValueError: a server's address is invalid.
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
        urls = addresses(server)
        key = _key(server, urls)
        self._secrets = Secrets(key, *map(str, urls))
        self._logs = RedactingLogFilter(self._secrets)
        self._fields = _fixed_fields(model, settings)
        endpoints = [Endpoint(url, model, server, key) for url in urls]
        self._endpoints = Endpoints(endpoints, model, self._supervisor)
        self.identity = json.dumps(
            {"server": endpoints[0].place, "fields": self._fields, "seed": settings.seed},
            sort_keys=True,
        )

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The next turn, as :class:`agents.vlm.chat.Client` has it."""
        body = self._body(messages, seed)
        request_size = RequestSize.of(body, messages, picture_bytes(messages), self._fields)
        request = self._supervisor.request(seed)
        request.of = self._settings.server.tries
        late = 0
        for request.attempt in itertools.count(1):
            with self._endpoints.use() as used:
                self._check(request, used.endpoint)
                answer = self._try(used.endpoint, body, request_size, request)
                if isinstance(answer, Failure) and answer.refuses:
                    answer = self._judged(answer, messages, request, used)
            if isinstance(answer, Reply):
                self._endpoints.replied(used)
                request.answered()
                return replace(answer, seconds=time.monotonic() - request.began)
            what = self._line(answer, used)
            answer = self._endpoints.failed(used, answer, what)
            if answer.fatal:
                raise self._supervisor.stop(self._with_tries(what, request))
            if answer.refuses:
                request.refused(what)
                raise ConversationRefused(what, answer.refuses)
            late += answer.timed_out
            if not answer.retryable or request.attempt == request.of or late == _LATE_TRIES:
                what = self._with_tries(what, request)
                if answer.no_server:
                    raise self._supervisor.stop(f"{what}; {_SEE_TO_IT}, and {AGAIN}")
                raise request.gave_up(what, partial(self._answers, messages, request, what))
            self._pause(answer, what, request)
        raise AssertionError("unreachable")

    def close(self) -> None:
        """Close all connections. Waiting callers get a ModelError."""
        self._supervisor.close()
        self._endpoints.close()
        self._logs.close()

    def _body(self, messages: Sequence[Message], seed: int) -> bytes:
        fields = self._fields
        if self._settings.seed is not None:
            fields = {**fields, "seed": (self._settings.seed + seed) % _SEEDS}
        return request_body(fields, messages, self._settings.reasoning.in_history)

    # -- one try -----------------------------------------------------------------------------------

    def _check(self, request: Request, endpoint: Endpoint) -> None:
        """Wait for the rate limit and check the budget; raises CannotGoOn if it is spent."""
        endpoint.rate_limiter.wait(request)
        try:
            self._ledger.check()
        except CannotGoOn as error:
            # Answers under way are paid for and awaited; no thread tries again.
            self._supervisor.stop(str(error), waits_for_answers=True)
            raise

    def _try(
        self, endpoint: Endpoint, body: bytes, request_size: RequestSize, request: Request
    ) -> Reply | Failure:
        """A reply or a failure."""
        began = time.monotonic()
        try:
            answer = endpoint.send(body, request)
        except BaseException:  # the run ends, or Ctrl-C
            if request.answering:
                self._enter(b"", request_size, None, "the run has ended", request, began)
            raise
        if isinstance(answer, openai.OpenAIError):
            failure = failure_of(
                answer, key_from=self._settings.server.key_from, answered=endpoint.answered
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

    # -- the server's fault, or this conversation's ------------------------------------------------

    def _judged(
        self, failure: Failure, messages: Sequence[Message], request: Request, used: Use
    ) -> Failure:
        """A refusal of this conversation; fatal if the server refuses a short one as well."""
        if failure.known and used.endpoint.answered:
            return failure
        answer = self._probed(messages, request, used, self._line(failure, used))
        if isinstance(answer, Reply):
            return failure
        if answer.fatal or answer.refuses:
            fatal = answer.fatal or "every request like this will fail"
            return replace(failure, refuses="", fatal=fatal)
        return replace(failure, refuses="")

    def _answers(self, messages: Sequence[Message], request: Request, what: str) -> bool:
        """Whether a server answers a short conversation, though it gave this one no reply."""
        with self._endpoints.use() as used:
            return isinstance(self._probed(messages, request, used, what), Reply)

    def _probed(
        self, messages: Sequence[Message], request: Request, used: Use, what: str
    ) -> Reply | Failure:
        """The answer to a conversation of one short turn, with a picture if this one has some."""
        request.probing(what)
        self._check(request, used.endpoint)
        pictures = [part for each in messages for part in each.parts if isinstance(part, Picture)]
        least = sorted(pictures, key=lambda picture: len(picture.data))[:1]
        short = (Message("user", (_PROBE, *least)),)
        body = self._body(short, request.seed)
        size = RequestSize.of(body, short, picture_bytes(short), self._fields)
        answer = self._try(used.endpoint, body, size, request)
        if isinstance(answer, Reply):
            self._endpoints.replied(used)
            request.answered()
        return answer

    # -- between tries -----------------------------------------------------------------------------

    def _pause(self, failure: Failure, what: str, request: Request) -> None:
        """Report the failure and wait; raises CannotGoOn if the wait would be too long."""
        of = min(request.of, request.attempt + 1) if failure.timed_out else request.of
        if failure.server and self._endpoints.ready():  # it is told that this one is set aside
            request.retry(what, 0.0, of, shown=False)
            return
        growing = min(_LONGEST_PAUSE, _FIRST_PAUSE * 2.0 ** min(request.attempt - 1, 10))
        asked = self._endpoints.wait_asked(failure)
        pause = asked or growing * random.uniform(0.75, 1.0)
        left = request.left()
        if pause > left:
            raise self._supervisor.stop(
                f"{what}; the server asks to wait {duration(pause)}, and {duration(left)} of "
                f"--max-minutes are left; {AGAIN}"
                if asked
                else f"{what}; the minutes of --max-minutes are over; {AGAIN}"
            )
        if pause > _LONGEST_ASKED and math.isinf(left):
            raise self._supervisor.stop(
                f"{what}; the server asks to wait {duration(pause)}: {AGAIN} after that, or give "
                "--max-minutes, and er-gym waits"
            )
        request.retry(what, pause, of)
        if failure.server:
            request.wait(pause, unless=self._endpoints.ready)
        else:
            request.wait(pause)

    def _line(self, failure: Failure, used: Use) -> str:
        """One line with model, address and failure, without the key."""
        words = self._plain(failure.message)
        ends = f"; {self._plain(failure.fatal)}" if failure.fatal else ""
        return f"{self._model} at {used.endpoint.where}: {words}{ends}"

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


def _key(server: Server, urls: Sequence[httpx2.URL]) -> str:
    """The API key; "" if there is none and the servers may not need one."""
    key = os.environ.get(server.key_from, "").strip()
    if not (key.isascii() and key.isprintable()):
        raise CannotGoOn(f"{server.key_from} holds characters that no key contains; set it again")
    openais_own = httpx2.URL(OPENAI_URL).host in {url.host for url in urls}
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
