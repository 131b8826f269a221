"""Faults of a server of chat completions: a hundred ways in which it fails."""

from __future__ import annotations

import gzip
import json
import socket
import struct
import time
import zlib
from dataclasses import dataclass
from email.utils import formatdate
from typing import Any

from benchmarks.checks.refusals import REFUSALS, Refused
from benchmarks.harness.chat_server import (
    DELETE,
    GOOD,
    SAID,
    Exchange,
    Fault,
    body,
    completion,
    error,
    head,
    ok,
)

KEY = "sk-check-0a1b2c3d4e5f6a7b"
_DEEP = 100_000
_PROBE = b"Say OK."


def says(**changed: Any) -> Fault:
    """A good answer but for some fields."""
    body = json.dumps(completion(**changed)).encode()
    return lambda exchange: exchange.send(body)


def usage(**counts: Any) -> Fault:
    """A good answer with another count of tokens."""
    return says(usage=counts)


def refuses(refused: Refused) -> Fault:
    """Refuses every conversation but the short one that asks whether the server is there."""
    content = json.dumps(refused.body).encode()

    def fault(exchange: Exchange) -> None:
        if _PROBE in exchange.body:
            with exchange.chat_server.lock:
                exchange.chat_server.probed += 1
            ok(exchange)
        else:
            exchange.send(content, refused.status)

    return fault


def _reset(exchange: Exchange) -> None:
    exchange.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    exchange.connection.close()
    exchange.close_connection = True


def _hang_after_head(exchange: Exchange) -> None:
    exchange.connection.sendall(head(len(GOOD)))
    exchange.hang()


def _hang_in_body(exchange: Exchange) -> None:
    exchange.connection.sendall(head(len(GOOD)) + GOOD[:40])
    exchange.hang()


def _chunks_without_end(exchange: Exchange) -> None:
    exchange.connection.sendall(head(None, headers={"Transfer-Encoding": "chunked"}))
    while not exchange.chat_server.closing.wait(0.01):
        exchange.connection.sendall(b"1\r\nx\r\n")


def _continues(exchange: Exchange) -> None:
    while not exchange.chat_server.closing.wait(0.02):
        exchange.connection.sendall(b"HTTP/1.1 100 Continue\r\n\r\n")


def _date(seconds: float) -> str:
    return formatdate(time.time() + seconds, usegmt=True)


def _bomb() -> bytes:
    packer = zlib.compressobj(9, wbits=31)
    parts = [packer.compress(bytes(10_000_000)) for _ in range(60)]
    return b"".join([*parts, packer.flush()])


@dataclass(frozen=True)
class Case:
    """A fault of a server, and how a request to it may end.

    Attributes:
        name: of the fault.
        fault: the server's behaviour.
        ends: how a request may end: ``reply``, ``failed`` (its episode is over) or ``stopped``
            (the run is).
    """

    name: str
    fault: Fault
    ends: frozenset[str]


_REPLY, _NONE = frozenset({"reply"}), frozenset({"failed", "stopped"})
_STOPPED, _FAILED = frozenset({"stopped"}), frozenset({"failed"})
_NO_CHOICES: list[Any] = [None, [], {}, "x", 5, [None], [5], [{}]]
_NO_CHOICES += [[{"message": None}], [{"message": "x"}]]
_NO_WORDS: list[Any] = [5, True, {}, [], [5]]
_NO_COUNT: list[Any] = [None, 5, "x", [], {}]
_LEAK = {"error": {"message": f"Authorization: Bearer {KEY} is wrong"}}

CASES: list[Case] = [
    # no answer, or a slow one
    Case("hangs before the head", Exchange.hang, _NONE),
    Case("hangs after the head", _hang_after_head, _NONE),
    Case("hangs in the body", _hang_in_body, _NONE),
    Case("drips the head", lambda x: x.raw(*_bytes(head(9)), pause=0.1), _NONE),
    Case("drips the body", lambda x: x.raw(head(len(GOOD)), *_bytes(GOOD), pause=0.1), _NONE),
    Case("sends chunks without end", _chunks_without_end, _NONE),
    Case("sends 100 Continue without end", _continues, _NONE),
    Case("hangs up", lambda x: x.raw(), _NONE),
    Case("resets the connection", _reset, _NONE),
    Case("hangs up in the head", lambda x: x.raw(b"HTTP/1.1 200 OK\r\nContent-"), _NONE),
    Case("hangs up in the body", lambda x: x.raw(head(900), GOOD[:20]), _NONE),
    Case("promises more than comes", lambda x: x.raw(head(len(GOOD) + 9) + GOOD), _NONE),
    # not HTTP
    Case("does not speak HTTP", lambda x: x.raw(b"220 mail ready\r\n"), _NONE),
    Case("sends zeros", lambda x: x.raw(bytes(5000)), _NONE),
    Case("sends a huge header", lambda x: x.raw(head(2, headers={"X": "x" * 200_000}), b"{}"), _NONE),
    Case("sends a wrong length", lambda x: x.raw(b"HTTP/1.1 200 OK\r\nContent-Length: -5\r\n\r\n"), _NONE),
    Case("sends broken chunks", lambda x: x.raw(head(None, headers={"Transfer-Encoding": "chunked"}), b"zz\r\n"), _NONE),
    Case("sends the status 999", lambda x: x.raw(b"HTTP/1.1 999 X\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"), _NONE),
    Case("switches protocols", lambda x: x.raw(b"HTTP/1.1 101 X\r\nUpgrade: y\r\n\r\n"), _NONE),
    # bodies
    Case("sends nothing", body(b""), _NONE),
    Case("answers 204", lambda x: x.raw(head(None, 204)), _NONE),
    Case("sends HTML", body(b"<html>Welcome</html>", Content_Type="text/html"), _NONE),
    Case("sends good JSON as HTML", body(GOOD, Content_Type="text/html"), _REPLY),
    Case("sends good JSON as a picture", body(GOOD, Content_Type="image/png"), _REPLY),
    Case("sends half of the body", body(GOOD[: len(GOOD) // 2]), _NONE),
    Case("sends the body twice", body(GOOD * 2), _NONE),
    Case("sends events", body(b"data: " + GOOD + b"\n\ndata: [DONE]\n\n"), _NONE),
    Case("sends half a character", body(GOOD.replace(b"end", rb"\ud800")), _NONE | _REPLY),
    Case("sends wrong UTF-8", body(GOOD.replace(b"end", b"\xff\xfe")), _NONE),
    Case("sends UTF-16", body(GOOD.decode().encode("utf-16")), _NONE),
    Case("nests deeply", body(b"[" * _DEEP + b"]" * _DEEP), _NONE),
    Case("nests a usage deeply", body(GOOD.replace(b"50", b"[" * _DEEP + b"]" * _DEEP)), _NONE | _REPLY),
    Case("sends null", body(b"null"), _NONE),
    Case("sends a list", body(b"[1]"), _NONE),
    Case("sends a long number", body(GOOD.replace(b"50", b"9" * 9000)), _NONE | _REPLY),
    Case("sends 30 MB", lambda x: x.send(b" " * 30_000_000), _NONE),
    # encodings
    Case("compresses", body(gzip.compress(GOOD), Content_Encoding="gzip"), _REPLY),
    Case("cuts gzip", body(gzip.compress(GOOD)[:-20], Content_Encoding="gzip"), _NONE),
    Case("sends gzip that is not gzip", body(GOOD, Content_Encoding="gzip"), _NONE),
    Case("sends a decompression bomb", body(_bomb(), Content_Encoding="gzip"), _NONE),
    Case("sends an unknown encoding", body(GOOD, Content_Encoding="rot13"), _NONE),
    # wrong types
    *(
        Case(f"sends choices {value!r}", says(choices=value), _NONE)
        for value in _NO_CHOICES
    ),
    *(
        Case(f"says {value!r}", says(choices__0__message__content=value), _NONE)
        for value in _NO_WORDS
    ),
    *(
        Case(f"sends {path} {value!r}", says(**{path: value}), _REPLY)
        for path, value in (
            ("model", 5),
            ("model", {"a": 1}),
            ("id", None),
            ("created", "x"),
            ("choices__0__finish_reason", 5),
            ("choices__0__message__role", 5),
            ("choices__0__message__refusal", {}),
            ("choices__0__message__reasoning_content", [1]),
            ("choices__0__message__tool_calls", "x"),
            ("choices__0__message__tool_calls", [{"function": {"arguments": 5}}]),
            ("choices__0__message__content", None),
        )
    ),
    # counts of tokens
    Case("sends no token counts", says(usage=DELETE), _REPLY),
    *(Case(f"counts {value!r}", says(usage=value), _REPLY) for value in _NO_COUNT),
    *(
        Case(f"counts {value!r} of both", usage(prompt_tokens=value, completion_tokens=value), _REPLY)
        for value in (-1_000_000, 0, 10**12, 10**30, 1.5, "7", True, float("nan"), float("inf"), [7])
    ),
    *(
        Case(
            f"remembers {value!r}",
            usage(prompt_tokens=50, completion_tokens=9, prompt_tokens_details={"cached_tokens": value}),
            _REPLY,
        )
        for value in (51, 10**9, -10**9, "x", float("nan"))
    ),
    # statuses
    *(Case(f"answers {status}", error(status), _STOPPED) for status in (400, 401, 402, 403, 404, 422)),
    *(Case(f"answers {status}", error(status), _NONE) for status in (408, 409, 413, 418, 429, 451, 500, 502, 503, 529, 599)),
    Case("has no quota", body(b'{"error": {"code": "insufficient_quota"}}', 429), _STOPPED),
    *(
        Case(f"answers 429, Retry-After {after!r}", error(429, Retry_After=after), _NONE)
        for after in ("0", "0.05", "-5", "soon", "nan", "1e-9", "", "0x10", "١", _date(-100), _date(1))
    ),
    *(
        Case(f"answers 503, Retry-After {after!r}", error(503, Retry_After=after), _STOPPED)
        for after in ("300", "86400", "1e400", "inf", _date(3600))
    ),
    *(
        Case(f"redirects to {place}", body(b"", status, Location=place), _STOPPED)
        for status in (301, 307, 308)
        for place in ("/v1/chat/completions", "http://127.0.0.1:1/x", "file:///etc/passwd", "")
    ),
    # refusals of one conversation: none of them stops the run
    *(Case(f"refuses, {each.status}: {each.words[:60]}", refuses(each), _FAILED) for each in REFUSALS),
    Case("refuses, 400: no", refuses(Refused("request", 400, "no")), _FAILED),
    Case("refuses, 500: no", refuses(Refused("request", 500, "no")), _FAILED),
    # the key, again
    Case("repeats the key in a reply", says(choices__0__message__content=f"{SAID} {KEY}", model=KEY), _REPLY),
    Case("repeats the key in its thoughts", says(choices__0__message__reasoning=KEY, choices__0__finish_reason=KEY), _REPLY),
    Case("repeats the key in a call", says(choices__0__message__tool_calls=[{"function": {"arguments": json.dumps({"action": KEY})}}]), _REPLY),
    Case("repeats the key in a header", body(GOOD, X_Request_Id=KEY, more={KEY: "x"}), _REPLY),
    Case("repeats the key in the status line", lambda x: x.raw(f"HTTP/1.1 500 {KEY}\r\nConnection: close\r\nContent-Length: 0\r\n\r\n".encode()), _NONE),
    Case("repeats the key outside of "
    "HTTP", lambda x: x.raw(f"{KEY}: what?\r\n\r\n".encode()), _NONE),
    Case("repeats the key in HTML", body(f"<b>{KEY}</b>".encode()), _NONE),
    Case("repeats the key in a Location", body(b"", 302, Location=f"http://x/?key={KEY}"), _STOPPED),
    *(
        Case(f"repeats the key with {status}", body(json.dumps(_LEAK).encode(), status), _NONE)
        for status in (400, 401, 429, 500)
    ),
    Case("repeats the key at the end of a long error", error(500, "x" * 395 + KEY), _NONE),
    Case("writes to the terminal", error(500, "\x1b[2J\x1b]0;owned\x07\r\nline"), _NONE),
]  # fmt: skip


def _bytes(data: bytes) -> list[bytes]:
    return [data[place : place + 1] for place in range(len(data))]
