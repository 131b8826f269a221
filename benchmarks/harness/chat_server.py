"""A server of chat completions on the loopback, over real HTTP, that answers as a script says.

A :data:`Fault` answers one request. Those made here answer well or badly, with given words or given
bytes; :mod:`benchmarks.checks.faulty_server` has a hundred bad ones.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import random
import select
import socket
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from er_gym.tasks.task import Task

SAID = "<DecisionMaking>end</DecisionMaking>"
DELETE = object()

Messages = Sequence[Mapping[str, Any]]


class Exchange(BaseHTTPRequestHandler):
    """One request, which a fault answers as it likes."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    chat_server: ChatServer
    body: bytes

    @property
    def messages(self) -> Messages:
        """Those of the request."""
        messages: Messages = json.loads(self.body)["messages"]
        return messages

    def do_POST(self) -> None:
        self.body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        with self.chat_server.lock:
            self.chat_server.count += 1
            number = self.chat_server.count
        good = number <= self.chat_server.good_first
        with contextlib.suppress(OSError):
            (ok if good else self.chat_server.fault)(self)

    def raw(self, *pieces: bytes, pause: float = 0.0) -> None:
        """Send bytes as they are, and hang up."""
        self.close_connection = True
        for piece in pieces:
            self.connection.sendall(piece)
            if pause and self.chat_server.closing.wait(pause):
                return

    def hang(self) -> None:
        """Send nothing more until the server closes."""
        self.chat_server.closing.wait(600)
        self.close_connection = True

    def send(
        self, body: bytes, status: int = 200, headers: Mapping[str, str] | None = None
    ) -> None:
        """An answer, after which the server hangs up."""
        if 200 <= status < 300:
            with self.chat_server.lock:
                self.chat_server.accepted += 1
        self.raw(head(len(body), status, headers) + body)

    def has_gone(self) -> bool:
        """Whether the client has hung up; then the connection is closed."""
        ready, _, _ = select.select([self.connection], [], [], 0)
        self.close_connection = bool(ready) and not self.connection.recv(1, socket.MSG_PEEK)
        return self.close_connection

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing."""


Fault = Callable[[Exchange], None]


def head(length: int | None, status: int = 200, headers: Mapping[str, str] | None = None) -> bytes:
    """The head of an answer."""
    given = {"Content-Type": "application/json", "Connection": "close", **(headers or {})}
    if length is not None:
        given["Content-Length"] = str(length)
    lines = "".join(f"{name}: {value}\r\n" for name, value in given.items())
    return f"HTTP/1.1 {status} Whatever\r\n{lines}\r\n".encode()


def completion(**changed: Any) -> dict[str, Any]:
    """A good answer, with changes by path: ``choices__0__message__content=1``."""
    answer: Any = {
        "id": "1",
        "object": "chat.completion",
        "created": 0,
        "model": "faulty",
        "choices": [
            {
                "index": 0,
                "message": {"role": "assistant", "content": SAID},
                "finish_reason": "stop",
            }
        ],
        "usage": {"prompt_tokens": 50, "completion_tokens": 9, "total_tokens": 59},
    }
    for path, value in changed.items():
        place = answer
        *way, last = [int(name) if name.isdecimal() else name for name in path.split("__")]
        for name in way:
            place = place[name] if isinstance(name, int) else place.setdefault(name, {})
        if value is DELETE:
            del place[last]
        else:
            place[last] = value
    return dict(answer)


def body(
    content: bytes, status: int = 200, more: Mapping[str, str] | None = None, **headers: str
) -> Fault:
    """An answer of these bytes; ``_`` stands for ``-`` in a header's name."""
    named = {name.replace("_", "-"): value for name, value in headers.items()} | dict(more or {})
    return lambda exchange: exchange.send(content, status, named)


GOOD = json.dumps(completion()).encode()
ok = body(GOOD)


def error(status: int, message: str = "no", **headers: str) -> Fault:
    """An error in OpenAI's form."""
    return body(json.dumps({"error": {"message": message}}).encode(), status, None, **headers)


def replies(
    say: Callable[[Messages], str],
    *,
    latency: float = 0.0,
    keep: bool = False,
    tokens: Callable[[bytes, str], tuple[int, int]] | None = None,
    **changed: Any,
) -> Fault:
    """A good answer in form, with these words.

    Args:
        say: the words, given the conversation.
        latency: seconds from the request to the answer.
        keep: whether the connection is kept.
        tokens: how many are counted of a request's body and of the words; those of
            :func:`completion` by default.
        changed: see :func:`completion`.
    """

    def fault(exchange: Exchange) -> None:
        arrived = time.monotonic()
        words, usage = say(exchange.messages), {}
        if tokens is not None:
            heard, said = tokens(exchange.body, words)
            told = {"prompt_tokens": heard, "completion_tokens": said, "total_tokens": heard + said}
            usage = {"usage": told}
        made = completion(choices__0__message__content=words, **usage, **changed)
        answer = json.dumps(made).encode()
        exchange.chat_server.closing.wait(max(0.0, latency - (time.monotonic() - arrived)))
        if exchange.has_gone():
            return
        with exchange.chat_server.lock:
            exchange.chat_server.answered[hashlib.sha256(exchange.body).digest()] += 1
        exchange.send(answer, headers={"Connection": "keep-alive"} if keep else None)
        exchange.close_connection = not keep

    return fault


def drawn(faults: Mapping[str, tuple[float, Fault]], seed: int) -> Fault:
    """One of some faults, drawn for each request by their weights."""
    draws = random.Random(seed)
    weights = [weight for weight, _ in faults.values()]

    def fault(exchange: Exchange) -> None:
        with exchange.chat_server.lock:
            (name,) = draws.choices([*faults], weights)
            exchange.chat_server.drawn[name] += 1
        faults[name][1](exchange)

    return fault


def counts(prompt: int, completion: int) -> Callable[[bytes, str], tuple[int, int]]:
    """So many tokens of every request and reply; see :func:`replies`."""
    return lambda heard, said: (prompt, completion)


def key_actions(tasks: Iterable[Task]) -> Callable[[Messages], str]:
    """The words of a model that does the next key action of the conversation's task."""
    actions = {
        task.instruction: [f"{key.verb} {key.actual_type}".strip() for key in task.key_actions]
        for task in tasks
    }

    def say(messages: Messages) -> str:
        told = text_of(next(each for each in messages if each["role"] == "user"))
        mine = next(keys for instruction, keys in actions.items() if instruction in told)
        said = sum(message["role"] == "assistant" for message in messages)
        action = mine[min(said, len(mine) - 1)]
        return f"<Thinking>Next.</Thinking><DecisionMaking>{action}</DecisionMaking>"

    return say


def text_of(message: Mapping[str, Any]) -> str:
    """The texts of a message, without its pictures."""
    content = message["content"]
    if isinstance(content, str):
        return content
    return "\n".join(part.get("text", "") for part in content)


class _Listener(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = 128

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Do not report clients that hang up."""


@dataclass
class ChatServer:
    """Serves one fault; use it as a context manager.

    Attributes:
        good_first: how many requests get a good answer first.
        count: the requests that came.
        accepted: the whole answers of status 2xx that were sent.
        probed: how many of them answered a question whether the server is there.
        answered: how often a request got a reply of :func:`replies`, by the digest of its body.
        drawn: how often :func:`drawn` drew each fault.
        url: for ``server.base_url``.
    """

    fault: Fault
    good_first: int = 0
    count: int = 0
    accepted: int = 0
    probed: int = 0
    answered: Counter[bytes] = field(default_factory=Counter)
    drawn: Counter[str] = field(default_factory=Counter)
    url: str = ""
    lock: threading.Lock = field(default_factory=threading.Lock)
    closing: threading.Event = field(default_factory=threading.Event)

    @property
    def repeated(self) -> int:
        """How many requests came again that had had a reply."""
        return self.answered.total() - len(self.answered)

    def __enter__(self) -> ChatServer:
        handler = type("_Bound", (Exchange,), {"chat_server": self})
        self._listener = _Listener(("127.0.0.1", 0), handler)
        self.url = f"http://127.0.0.1:{self._listener.server_port}/v1"
        threading.Thread(target=self._listener.serve_forever, args=(0.02,), daemon=True).start()
        return self

    def __exit__(self, *error: object) -> None:
        self.closing.set()
        self._listener.shutdown()
        self._listener.server_close()
