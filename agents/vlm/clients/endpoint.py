"""One server of a model: its address, connections, rate limit and health checks."""

from __future__ import annotations

from typing import Any

import httpx2
import openai

from agents.vlm.clients.supervisor import Request
from agents.vlm.clients.transport import BoundedTransport, RateLimiter
from agents.vlm.settings import Server

OPENAI_URL = "https://api.openai.com/v1"
_NOT_IMPLEMENTED = 501  # the server is there, and knows no list of models


class Endpoint:
    """Sends requests to one server. All threads share it.

    Args:
        url: its address, of :func:`addresses`.
        model: the model's name; on Azure, the deployment's.
        server: the settings of all servers.
        key: the API key; "" for none.

    Attributes:
        where: the address for messages, without user, password and query.
        place: the address that replies depend on: ``where`` without the port.
        answered: whether it has given a reply.
        rate_limiter: spaces the requests to it.
        transport: carries them.
    """

    def __init__(self, url: httpx2.URL, model: str, server: Server, key: str) -> None:
        self.where = f"{url.scheme}://{url.netloc.decode()}{url.path}".rstrip("/")
        self.place = f"{url.scheme}://{url.host}{url.path}".rstrip("/")
        self.answered = False
        self.rate_limiter = RateLimiter(server.requests_per_minute)
        self.transport = BoundedTransport(url, server.timeout, server.connect)
        self._look = server.connect  # seconds for a health check
        self._options: Any = {} if key else {"headers": {"Authorization": openai.Omit()}}
        plain = url.copy_with(query=None, fragment=None)
        options: dict[str, Any] = {
            # The SDK needs a value; without a key the header is removed from every request.
            "api_key": key or "none",
            "max_retries": 0,  # its waits can be neither reported nor ended
            "timeout": server.timeout,
            "default_headers": {"Accept-Encoding": "identity"},
            # A redirect may lead to another party, which would get the pictures.
            "http_client": openai.DefaultHttpxClient(
                transport=self.transport, follow_redirects=False
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

    def send(self, body: bytes, request: Request) -> httpx2.Response | openai.OpenAIError:
        """One try of a request: the answer, or the error. An error is returned, not raised: an
        exception that may hold the key must not become the context of another."""
        self.transport.begin_try(request)
        try:
            return self._sdk.post(
                "/chat/completions", cast_to=httpx2.Response, content=body, options=self._options
            )
        except openai.OpenAIError as error:
            return error

    def is_up(self, request: Request) -> bool:
        """Whether the server answers a request for its models, even with a refusal."""
        self.transport.begin_try(request, self._look)
        try:
            self._sdk.get("/models", cast_to=httpx2.Response, options=self._options)
        except openai.APIStatusError as error:
            return error.status_code < 500 or error.status_code == _NOT_IMPLEMENTED
        except openai.OpenAIError:
            return False
        return True

    def close(self) -> None:
        """Close all connections."""
        self._sdk.close()


def addresses(server: Server) -> tuple[httpx2.URL, ...]:
    """The addresses of a model's servers, checked.

    Raises:
        ValueError: one is not an address, or is given twice.
    """
    if server.api_version and not server.base_url:
        raise ValueError(
            "server.api_version says that the server is Azure's; give server.base_url too, such as "
            "https://NAME.openai.azure.com"
        )
    given = server.base_urls or (OPENAI_URL,)
    found = tuple(map(_address, given))
    plain = [str(url).rstrip("/") for url in found]
    for number, url in enumerate(plain):
        if url in plain[:number]:
            raise ValueError(
                f"server.base_url names {_without_secrets(given[number])!r} twice; name each "
                "server once"
            )
    return found


def _address(given: str) -> httpx2.URL:
    try:
        url = httpx2.URL(given)
    except httpx2.InvalidURL:
        url = httpx2.URL("")
    is_port = url.port is None or 0 < url.port < 1 << 16
    if url.scheme not in ("http", "https") or not url.host or not is_port:
        raise ValueError(
            f"server.base_url {_without_secrets(given)!r} is not an address; give one such as "
            "http://127.0.0.1:8000/v1"
        )
    return url


def _without_secrets(given: str) -> str:
    return given.rpartition("@")[2].partition("?")[0]
