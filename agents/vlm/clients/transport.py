"""The HTTP transport of the OpenAI SDK: a whole answer within the time limit, or an error.

Each call is one try. The SDK's own time limits apply to single reads, so a slow trickle of bytes
never times out; here the limit applies to the whole try. The size of answers is limited, also after
decompression.
"""

from __future__ import annotations

import math
import ssl
import threading
import time
import zlib
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from typing import Any
from urllib.parse import unquote, urlsplit
from urllib.request import getproxies, proxy_bypass

import httpcore2
import httpx2
from openai import OpenAIError

from agents.vlm.clients.supervisor import Request

LARGEST_ANSWER = 20_000_000
"""The largest answer in bytes."""
_AT_ONCE = 262_144  # bytes written between two looks at the clock
_LOOK = 0.5  # seconds of waiting between two looks at the run

_KNOWN_TO_THE_SDK: Mapping[type[Exception], type[httpx2.TransportError]] = {
    httpcore2.TimeoutException: httpx2.ReadTimeout,
    httpcore2.ConnectError: httpx2.ConnectError,
    httpcore2.NetworkError: httpx2.NetworkError,
    httpcore2.ProtocolError: httpx2.RemoteProtocolError,
    httpcore2.ProxyError: httpx2.ProxyError,
}
"""Connection errors, special ones first, and the errors that the SDK handles."""


class AnswerTooLong(OpenAIError):
    """An answer exceeds :data:`LARGEST_ANSWER`."""


class RateLimiter:
    """Spaces requests evenly over all threads of the process.

    Args:
        per_minute: the most requests per minute; None for no limit.
    """

    def __init__(self, per_minute: int | None) -> None:
        self._gap = 60 / per_minute if per_minute else 0.0
        self._next = 0.0
        self._lock = threading.Lock()

    def wait(self, request: Request) -> None:
        """Wait for the next free slot; raises as ``Request.wait`` does."""
        with self._lock:
            turn = max(time.monotonic(), self._next)
            self._next = turn + self._gap
        request.wait(max(0.0, turn - time.monotonic()))


class BoundedTransport(httpx2.BaseTransport):
    """A transport for one server.

    Args:
        url: the server's address; it decides which of the environment's proxies is used. Its query
            is sent with each request.
        timeout: seconds for a try, from the first byte sent to the last byte received.
        connect: the part of ``timeout`` for the connection, seconds.
    """

    def __init__(self, url: httpx2.URL, timeout: float, connect: float) -> None:
        self._deadline = _TryDeadline()
        self._timeout, self._query = timeout, url.query
        self._pool = httpcore2.ConnectionPool(
            ssl_context=httpx2.create_ssl_context() if url.scheme == "https" else None,
            proxy=_proxy_for(str(url)),
            max_connections=None,
            keepalive_expiry=5.0,
            network_backend=_TimedBackend(self._deadline, connect),
        )

    def begin_try(self, request: Request, timeout: float = math.inf) -> None:
        """Count what this thread sends next as a try of this request.

        Args:
            request: what is tried.
            timeout: seconds for this try, where the transport's own are more.
        """
        self._deadline.request, self._deadline.most = request, min(timeout, self._timeout)

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        """Send a request and read the answer to its end.

        Raises:
            httpx2.TransportError: there is no answer, or it is broken.
            AnswerTooLong: the answer is too long.
            CannotGoOn: the run ends meanwhile.
        """
        self._deadline.start()
        try:
            return self._whole(request)
        except httpcore2.TimeoutException as error:
            self._deadline.request.left(answering=True)  # it may be the run's end that came first
            if isinstance(error, _NoConnection):
                raise httpx2.ConnectTimeout(str(error), request=request) from None
            late = f"no whole answer within {self._deadline.most:g} s"
            raise httpx2.ReadTimeout(late, request=request) from None
        except tuple(_KNOWN_TO_THE_SDK) as error:
            known = next(
                theirs for ours, theirs in _KNOWN_TO_THE_SDK.items() if isinstance(error, ours)
            )
            raise known(str(error) or type(error).__name__, request=request) from None

    def _whole(self, request: httpx2.Request) -> httpx2.Response:
        url = request.url
        assert isinstance(request.stream, httpx2.SyncByteStream)
        target = url.raw_path
        if self._query:
            target += (b"&" if b"?" in target else b"?") + self._query
        answer = self._pool.handle_request(
            httpcore2.Request(
                request.method,
                httpcore2.URL(
                    scheme=url.raw_scheme, host=url.raw_host, port=url.port, target=target
                ),
                headers=request.headers.raw,
                content=request.stream,
                extensions=request.extensions,
            )
        )
        self._deadline.request.answering = 200 <= answer.status < 300
        try:
            parts, size = [], 0
            for part in answer.iter_stream():
                parts.append(part)
                size += len(part)
                if size > LARGEST_ANSWER:
                    raise _too_long()
        finally:
            answer.close()
        headers = httpx2.Headers(answer.headers)
        content = _decompressed(b"".join(parts), headers.pop("Content-Encoding", ""), request)
        return httpx2.Response(answer.status, headers=headers, content=content)

    def close(self) -> None:
        """Close all connections."""
        self._pool.close()


def _decompressed(content: bytes, encoding: str, request: httpx2.Request) -> bytes:
    """Decompress an answer, up to the size limit; servers may compress without being asked."""
    encoding = encoding.strip().lower()
    if encoding in ("", "identity"):
        return content
    if encoding not in ("gzip", "x-gzip", "deflate"):
        raise httpx2.DecodingError(f"an answer in the unknown encoding {encoding}", request=request)
    stream = zlib.decompressobj(wbits=32 + zlib.MAX_WBITS)  # of either format
    try:
        plain = stream.decompress(content, LARGEST_ANSWER + 1)
    except zlib.error as error:
        raise httpx2.DecodingError(
            f"a broken {encoding} answer: {error}", request=request
        ) from None
    if len(plain) > LARGEST_ANSWER:
        raise _too_long()
    if not stream.eof:
        raise httpx2.DecodingError(f"a {encoding} answer that is cut off", request=request)
    return plain


def _too_long() -> AnswerTooLong:
    return AnswerTooLong(f"an answer of more than {LARGEST_ANSWER:,} bytes")


def _proxy_for(url: str) -> httpcore2.Proxy | None:
    """The proxy for a URL, from ``HTTPS_PROXY``, ``NO_PROXY`` and related variables."""
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


class _TryDeadline(threading.local):
    """The time that a try has left; one thread handles a request from start to end."""

    request: Request
    most: float
    _end = _began = 0.0

    def start(self) -> None:
        self.request.answering = False
        self._began = time.monotonic()
        self._end = self._began + min(self.most, self.request.left())

    def left(self) -> float:
        left = self._end - time.monotonic()
        if left <= 0:
            raise httpcore2.TimeoutException
        return left

    def look(self) -> None:
        """Report that the request still waits; raises the error that ends the run."""
        self.request.left(answering=True)
        waited, most = time.monotonic() - self._began, self._end - self._began
        self.request.still_waiting(
            f"no answer for {waited:.0f} s; the limit is {most:.0f} s", waited
        )


class _TimedStream(httpcore2.NetworkStream):
    """A connection whose reads and writes end with the try's time."""

    def __init__(self, inner: httpcore2.NetworkStream, clock: _TryDeadline) -> None:
        self._inner, self._deadline = inner, clock

    def read(self, max_bytes: int, timeout: float | None = None) -> bytes:
        while True:
            left = self._deadline.left()
            try:
                return self._inner.read(max_bytes, min(left, _LOOK))
            except httpcore2.ReadTimeout:
                self._deadline.look()

    def write(self, buffer: bytes, timeout: float | None = None) -> None:
        for start in range(0, len(buffer), _AT_ONCE):
            self._inner.write(buffer[start : start + _AT_ONCE], self._deadline.left())

    def start_tls(
        self,
        ssl_context: ssl.SSLContext,
        server_hostname: str | None = None,
        timeout: float | None = None,
    ) -> httpcore2.NetworkStream:
        left = self._deadline.left()
        return _TimedStream(
            self._inner.start_tls(ssl_context, server_hostname, left), self._deadline
        )

    def get_extra_info(self, info: str) -> Any:
        return self._inner.get_extra_info(info)

    def close(self) -> None:
        self._inner.close()


class _NoConnection(httpcore2.ConnectTimeout):
    """The connection failed before the try's time was over."""


class _TimedBackend(httpcore2.NetworkBackend):
    """Opens connections with a time limit."""

    def __init__(self, clock: _TryDeadline, connect: float) -> None:
        self._inner, self._deadline, self._connect = httpcore2.SyncBackend(), clock, connect

    def connect_tcp(
        self,
        host: str,
        port: int,
        timeout: float | None = None,
        local_address: str | None = None,
        socket_options: Iterable[httpcore2.SOCKET_OPTION] | None = None,
    ) -> httpcore2.NetworkStream:
        left = self._deadline.left()
        try:
            stream = self._inner.connect_tcp(
                host, port, min(left, self._connect), local_address, socket_options
            )
        except httpcore2.ConnectTimeout:
            if left <= self._connect:
                raise
            raise _NoConnection(f"no connection within {self._connect:g} s") from None
        return _TimedStream(stream, self._deadline)
