"""What carries the OpenAI SDK's requests: a whole answer in time, or an error that it tries again.

The SDK retries what fails below it: connections, time-outs, 408, 409, 429, 5xx; after the time that
the server asks for, or after growing pauses. It does not see what is no answer though it looks like
one: half a JSON text, no choices, bytes that drip so slowly that no single wait takes long. Here
all that becomes an error of the connection, so that the SDK counts and retries it like any other.
"""

from __future__ import annotations

import ssl
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from importlib.util import find_spec
from typing import Any
from urllib.parse import unquote, urlsplit
from urllib.request import getproxies, proxy_bypass

import httpcore2
import httpx2
from openai import OpenAIError

LARGEST_ANSWER = 20_000_000
"""Bytes; what is longer is no reply."""
_AT_ONCE = 262_144  # bytes written between two looks at the clock
_FOR_GOOD = b"insufficient_quota"

_KNOWN_TO_THE_SDK: Mapping[type[Exception], type[httpx2.TransportError]] = {
    httpcore2.TimeoutException: httpx2.ReadTimeout,
    httpcore2.ConnectError: httpx2.ConnectError,
    httpcore2.NetworkError: httpx2.NetworkError,
    httpcore2.ProtocolError: httpx2.RemoteProtocolError,
    httpcore2.ProxyError: httpx2.ProxyError,
}
"""The errors of connections, special ones first, and what the SDK retries them as."""


class AnswerTooLong(OpenAIError):
    """An answer without end. The SDK passes errors of its own on, and does not retry them."""


class Pace:
    """Spreads requests evenly, over all threads of the process.

    Args:
        per_minute: at most so many; None for no limit.
    """

    def __init__(self, per_minute: int | None) -> None:
        self._gap = 60 / per_minute if per_minute else 0.0
        self._next = 0.0
        self._lock = threading.Lock()
        self._closed = threading.Event()

    def wait(self) -> None:
        """Wait for one's turn; OpenAIError if there will be none."""
        with self._lock:
            turn = max(time.monotonic(), self._next)
            self._next = turn + self._gap
        if self._closed.wait(max(0.0, turn - time.monotonic())):
            raise OpenAIError("the client has been closed")

    def close(self) -> None:
        """Let nobody wait any longer, and nothing be sent."""
        self._closed.set()


class WholeAnswers(httpx2.BaseTransport):
    """A transport for one server.

    A good answer has what ``read`` made of it in ``response.extensions["read"]``.

    Args:
        url: of the server; says whether one of the environment's proxies is in between.
        timeout: seconds for a try, from the first byte sent to the last received.
        read: makes something of the body of an answer with status 200; ValueError if it is none.
        pace: of the tries.
    """

    def __init__(self, url: str, timeout: float, read: Callable[[bytes], Any], pace: Pace) -> None:
        self._clock = _Clock()
        self._timeout, self._read, self._pace = timeout, read, pace
        self._pool = httpcore2.ConnectionPool(
            ssl_context=httpx2.create_ssl_context() if url.startswith("https:") else None,
            proxy=_proxy_for(url),
            max_connections=None,
            keepalive_expiry=5.0,
            network_backend=_TimedBackend(self._clock),
        )

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request and read the answer to its end."""
        self._pace.wait()
        self._clock.start(self._timeout)
        try:
            response = self._whole(request)
        except httpcore2.TimeoutException:
            late = f"no whole answer within {self._timeout:g} s"
            raise httpx2.ReadTimeout(late, request=request) from None
        except tuple(_KNOWN_TO_THE_SDK) as error:
            known = next(
                theirs for ours, theirs in _KNOWN_TO_THE_SDK.items() if isinstance(error, ours)
            )
            raise known(str(error) or type(error).__name__, request=request) from None
        if response.is_success:
            try:
                response.extensions["read"] = self._read(response.content)
            except ValueError as error:
                raise httpx2.RemoteProtocolError(str(error), request=request) from None
        elif _FOR_GOOD in response.content:
            response.headers["x-should-retry"] = "false"
        return response

    def _whole(self, request: httpx2.Request) -> httpx2.Response:
        url = request.url
        assert isinstance(request.stream, httpx2.SyncByteStream)
        answer = self._pool.handle_request(
            httpcore2.Request(
                request.method,
                httpcore2.URL(
                    scheme=url.raw_scheme, host=url.raw_host, port=url.port, target=url.raw_path
                ),
                headers=request.headers.raw,
                content=request.stream,
                extensions=request.extensions,
            )
        )
        try:
            parts, size = [], 0
            for part in answer.iter_stream():
                parts.append(part)
                size += len(part)
                if size > LARGEST_ANSWER:
                    raise AnswerTooLong(f"an answer of more than {LARGEST_ANSWER:,} bytes")
        finally:
            answer.close()
        return httpx2.Response(answer.status, headers=answer.headers, content=b"".join(parts))

    def close(self) -> None:
        """Close all connections."""
        self._pace.close()
        self._pool.close()


def _proxy_for(url: str) -> httpcore2.Proxy | None:
    """The environment's proxy for a URL, as ``HTTPS_PROXY``, ``NO_PROXY`` and their like say."""
    place = urlsplit(url)
    known = getproxies()
    proxy = known.get(place.scheme) or known.get("all")
    if not proxy or proxy_bypass(_without_user(place.netloc)):
        return None
    parts = urlsplit(proxy if "://" in proxy else f"http://{proxy}")
    if parts.scheme.startswith("socks") and find_spec("socksio") is None:
        raise ValueError("the environment names a SOCKS proxy, which needs: pip install socksio")
    auth = (unquote(parts.username), unquote(parts.password or "")) if parts.username else None
    return httpcore2.Proxy(f"{parts.scheme}://{_without_user(parts.netloc)}", auth=auth)


def _without_user(netloc: str) -> str:
    return netloc.rpartition("@")[2]


# -- time ------------------------------------------------------------------------------------------


class _Clock(threading.local):
    """How much time is left; a request is one thread's from beginning to end."""

    _end = 0.0

    def start(self, seconds: float) -> None:
        self._end = time.monotonic() + seconds

    def left(self) -> float:
        left = self._end - time.monotonic()
        if left <= 0:
            raise httpcore2.TimeoutException
        return left


class _TimedStream(httpcore2.NetworkStream):
    """A connection on which no wait goes beyond the time that is left."""

    def __init__(self, inner: httpcore2.NetworkStream, clock: _Clock) -> None:
        self._inner, self._clock = inner, clock

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        return self._inner.read(max_bytes, self._clock.left())

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        for start in range(0, len(buffer), _AT_ONCE):
            self._inner.write(buffer[start : start + _AT_ONCE], self._clock.left())

    def start_tls(
        self,
        ssl_context: ssl.SSLContext,
        server_hostname: str | None = None,
        timeout: float | None = None,
    ) -> httpcore2.NetworkStream:
        left = self._clock.left()
        return _TimedStream(self._inner.start_tls(ssl_context, server_hostname, left), self._clock)

    def get_extra_info(self, info: str) -> Any:
        return self._inner.get_extra_info(info)

    def close(self) -> None:
        self._inner.close()


class _TimedBackend(httpcore2.NetworkBackend):
    """Makes such connections."""

    def __init__(self, clock: _Clock) -> None:
        self._inner, self._clock = httpcore2.SyncBackend(), clock

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[httpcore2.SOCKET_OPTION] | None = None,
    ) -> httpcore2.NetworkStream:
        left = self._clock.left()
        stream = self._inner.connect_tcp(host, port, left, local_address, socket_options)
        return _TimedStream(stream, self._clock)
