"""An OpenAI-compatible server that misbehaves on demand: real sockets, no model.

In a test, ``with NaughtyServer(script=["429", "reset"]) as server:`` answers at ``server.url``. As
a program it prints its URL and serves until it is killed::

    python tests/agents/vlm/naughty_server.py --port 0 --latency 0.1 --mixture ok=8,500=1,reset=1
"""

from __future__ import annotations

import argparse
import contextlib
import json
import random
import socket
import struct
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

MODEL = "naughty-1"
HUGE = 2_000_000
ENDLESS = 40_000_000
_DRIP = 0.05  # seconds between two bytes
_BLOCK = b"x" * 65_536

Answer = Callable[[list[dict[str, Any]]], "str | dict[str, Any] | Raw"]
"""From the conversation, as it came over the wire, to the assistant's words or whole message, or
to an answer of one's own."""


@dataclass(frozen=True)
class Raw:
    """An answer of one's own; a body that is not bytes is sent as JSON."""

    body: Any
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Seen:
    """A request that came: when (monotonic seconds), where to, with which headers (names in lower
    case) and, if the server keeps them, body."""

    at: float
    path: str
    headers: Mapping[str, str]
    body: bytes = b""

    @property
    def json(self) -> dict[str, Any]:
        """The body's content."""
        content: dict[str, Any] = json.loads(self.body)
        return content


def completion(message: Mapping[str, Any], body: bytes = b"", **choice: Any) -> dict[str, Any]:
    """The body of an answer; tokens are counted as four bytes each."""
    said = len(str(message.get("content") or "")) // 4 + 1
    heard = len(body) // 4
    return {
        "id": "chatcmpl-0",
        "object": "chat.completion",
        "created": 0,
        "model": MODEL,
        "choices": [
            {
                "index": 0,
                "message": {"role": "assistant", **message},
                "finish_reason": "stop",
                **choice,
            }
        ],
        "usage": {
            "prompt_tokens": heard,
            "completion_tokens": said,
            "total_tokens": heard + said,
        },
    }


class _Exchange(BaseHTTPRequestHandler):
    """One request after another of a connection."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    naughty: NaughtyServer
    body: bytes

    def setup(self) -> None:
        super().setup()
        self.naughty._connections.add(self.connection)

    def finish(self) -> None:
        self.naughty._connections.discard(self.connection)
        with contextlib.suppress(OSError):
            super().finish()

    def do_GET(self) -> None:
        if not self.path.endswith("/models"):
            return self.send(Raw({"error": {"message": "no such page"}}, 404))
        models = [{"id": MODEL, "object": "model", "created": 0, "owned_by": "nobody"}]
        return self.send(Raw({"object": "list", "data": models}))

    def do_POST(self) -> None:
        self.body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if not self.path.partition("?")[0].endswith("/chat/completions"):
            return self.send(Raw({"error": {"message": "no such page"}}, 404))
        behaviour = self.naughty._behaviour_for(self)
        self.naughty.wait(self.naughty.latency)
        if isinstance(behaviour, Raw):
            return self.send(behaviour)
        return BEHAVIOURS[behaviour](self)

    def completion(self, **choice: Any) -> Any:
        """What a well-behaved server would send; ``choice`` overrules fields of the message."""
        answer = self.naughty.answer
        said = answer(json.loads(self.body)["messages"]) if callable(answer) else answer
        if isinstance(said, Raw):
            return said
        message = {"content": said} if isinstance(said, str) else said
        return completion({**message, **choice}, self.body)

    def send(self, raw: Raw) -> None:
        """All at once: two writes would be two packets."""
        content = raw.body if isinstance(raw.body, bytes) else json.dumps(raw.body).encode()
        self.connection.sendall(_head(raw, len(content)) + content)

    def drip(self, data: bytes) -> None:
        """A byte now and then, until the other side has had enough or the server closes."""
        for place in range(len(data)):
            self.connection.sendall(data[place : place + 1])
            if self.naughty.wait(_DRIP):
                break
        self.close_connection = True

    def reset(self) -> None:
        """Hang up so that the other side sees "connection reset by peer"."""
        self.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.connection.close()
        self.close_connection = True

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


def _head(raw: Raw, length: int) -> bytes:
    headers = {"Content-Type": "application/json", **raw.headers, "Content-Length": str(length)}
    lines = "".join(f"{name}: {value}\r\n" for name, value in headers.items())
    return f"HTTP/1.1 {raw.status} Whatever\r\n{lines}\r\n".encode("latin-1")


def _error(status: int, message: str, code: str | None = None, **headers: str) -> Raw:
    error = {"message": message, "type": "naughty", "param": None, "code": code}
    return Raw({"error": error}, status, {name.replace("_", "-"): h for name, h in headers.items()})


def _ok(exchange: _Exchange) -> None:
    said = exchange.completion()
    exchange.send(said if isinstance(said, Raw) else Raw(said))


def _rate_limited(exchange: _Exchange) -> None:
    wait = exchange.naughty.retry_after
    exchange.send(_error(429, "slow down", "rate_limit_exceeded", Retry_After=wait))


def _half(exchange: _Exchange) -> None:
    raw = Raw(exchange.completion())
    content = json.dumps(raw.body).encode()
    exchange.connection.sendall(_head(raw, len(content)) + content[: len(content) // 2])
    exchange.close_connection = True


def _drip(exchange: _Exchange) -> None:
    raw = Raw(exchange.completion())
    content = json.dumps(raw.body).encode()
    exchange.connection.sendall(_head(raw, len(content)))
    exchange.drip(content)


def _drip_head(exchange: _Exchange) -> None:
    exchange.drip(_head(Raw(b""), 1_000_000))


def _stall(exchange: _Exchange) -> None:
    exchange.naughty.wait(600)
    exchange.close_connection = True


def _truncated(exchange: _Exchange) -> None:
    content = json.dumps(exchange.completion()).encode()
    exchange.send(Raw(content[: len(content) // 2]))


def _endless(exchange: _Exchange) -> None:
    exchange.connection.sendall(_head(Raw(b""), ENDLESS))
    for _ in range(ENDLESS // len(_BLOCK)):
        exchange.connection.sendall(_BLOCK)
    exchange.close_connection = True


def _says(**message: Any) -> Callable[[_Exchange], None]:
    return lambda exchange: exchange.send(Raw(exchange.completion(**message)))


def _fails(status: int, message: str, code: str | None = None) -> Callable[[_Exchange], None]:
    return lambda exchange: exchange.send(_error(status, message, code))


BEHAVIOURS: Mapping[str, Callable[[_Exchange], None]] = {
    "ok": _ok,
    "400": _fails(400, "unknown parameter 'top_p'", "unsupported_parameter"),
    "401": _fails(401, "incorrect key", "invalid_api_key"),
    "403": _fails(403, "not for you"),
    "404": _fails(404, "the model does not exist", "model_not_found"),
    "429": _rate_limited,
    "500": _fails(500, "something broke"),
    "503": _fails(503, "overloaded"),
    "quota": _fails(429, "you exceeded your current quota", "insufficient_quota"),
    "context": _fails(400, "maximum context length is 10 tokens", "context_length_exceeded"),
    "reset": _Exchange.reset,
    "half": _half,
    "drip": _drip,
    "drip_head": _drip_head,
    "stall": _stall,
    "truncated": _truncated,
    "empty_choices": lambda exchange: exchange.send(Raw({**exchange.completion(), "choices": []})),
    "html": lambda exchange: exchange.send(
        Raw(b"<html>Welcome</html>", headers={"Content-Type": "text/html"})
    ),
    "refusal": _says(content=None, refusal="I cannot help with that."),
    "no_content": _says(content=None),
    "wrong_tags": _says(content="<Decision>fly to the moon"),
    "huge": _says(content="x" * HUGE),
    "endless": _endless,
}
"""What a request can meet with, by name."""


class _Listener(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = 256

    def handle_error(self, request: Any, client_address: Any) -> None:
        if not isinstance(sys.exc_info()[1], OSError):  # do not report clients that hang up
            super().handle_error(request, client_address)


class NaughtyServer:
    """A server on the loopback; use it as a context manager.

    Args:
        answer: what it says: a text, or a function of the conversation. Bodies are read as JSON
            only for a function.
        script: what the first requests meet with, in the order in which they come: names of
            :data:`BEHAVIOURS`, or :class:`Raw` answers.
        mixture: names and weights, drawn from for each request after that; ``ok`` alone if empty.
        seed: of the drawing.
        latency: seconds before every answer.
        retry_after: what a 429 says.
        keep_bodies: whether :attr:`seen` has them.
        port: any for 0.

    Attributes:
        seen: the requests for completions so far.
        url: what clients call ``base_url``.
    """

    def __init__(
        self,
        answer: str | Answer = "observe",
        script: Iterable[str | Raw] = (),
        mixture: Mapping[str, float] | None = None,
        seed: int = 0,
        latency: float = 0.0,
        retry_after: str = "0.05",
        keep_bodies: bool = True,
        port: int = 0,
    ) -> None:
        self.answer, self.latency, self.retry_after = answer, latency, retry_after
        self.keep_bodies = keep_bodies
        self.seen: list[Seen] = []
        self._script: deque[str | Raw] = deque()
        self._mixture = dict(mixture or {"ok": 1.0})
        self._random = random.Random(seed)
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._connections: set[socket.socket] = set()
        self.then(*script)
        _check(self._mixture)
        handler = type("_Bound", (_Exchange,), {"naughty": self})
        self._listener = _Listener(("127.0.0.1", port), handler)
        self.url = f"http://127.0.0.1:{self._listener.server_port}/v1"
        threading.Thread(target=self._listener.serve_forever, args=(0.01,), daemon=True).start()

    def __enter__(self) -> NaughtyServer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def count(self) -> int:
        """How many requests came."""
        return len(self.seen)

    def then(self, *behaviours: str | Raw) -> None:
        """Let the next requests meet with these."""
        _check(behaviours)
        with self._lock:
            self._script.extend(behaviours)

    def wait(self, seconds: float) -> bool:
        """Wait; whether the server closes meanwhile."""
        return seconds > 0 and self._closing.wait(seconds)

    def close(self) -> None:
        """Hang up on everyone and free the port."""
        self._closing.set()
        self._listener.shutdown()
        self._listener.server_close()
        for connection in list(self._connections):
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _behaviour_for(self, exchange: _Exchange) -> str | Raw:
        headers = {name.lower(): value for name, value in exchange.headers.items()}
        body = exchange.body if self.keep_bodies else b""
        with self._lock:
            self.seen.append(Seen(time.monotonic(), exchange.path, headers, body))
            if self._script:
                return self._script.popleft()
            names, weights = list(self._mixture), list(self._mixture.values())
            return self._random.choices(names, weights)[0]


def _check(behaviours: Iterable[str | Raw]) -> None:
    for each in behaviours:
        if not isinstance(each, Raw) and each not in BEHAVIOURS:
            raise ValueError(f"{each!r} is no behaviour; choose of: {', '.join(BEHAVIOURS)}")


def _mixture(text: str) -> dict[str, float]:
    pairs = (each.partition("=") for each in text.split(",") if each)
    return {name: float(weight or 1) for name, _, weight in pairs}


def main() -> None:
    """Serve until killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--latency", type=float, default=0.0, help="seconds")
    parser.add_argument("--say", default="observe", help="what every answer says")
    parser.add_argument("--mixture", type=_mixture, default="ok=1", help="ok=8,500=1,reset=1")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    server = NaughtyServer(
        given.say,
        mixture=given.mixture,
        seed=given.seed,
        latency=given.latency,
        keep_bodies=False,
        port=given.port,
    )
    print(server.url, flush=True)
    threading.Event().wait()


if __name__ == "__main__":
    main()
