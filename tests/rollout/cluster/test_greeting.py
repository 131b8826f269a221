"""Addresses at which something else than Ray is, or what has stopped answering."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec

import pytest
from support import ROOT, in_one_test

from er_gym.rollout.cluster import session
from er_gym.rollout.cluster.greeting import problem_at
from er_gym.rollout.cluster.session import RayUnavailable, ray_backend
from er_gym.rollout.cluster.settings import RaySettings

SILENT = "PORT"
SETTINGS = b"\0\0\0\4\0\0\0\0\0"


@contextmanager
def server(answer: Callable[[socket.socket], None]) -> Iterator[int]:
    """A server on a free port that does this with each connection, and keeps it."""
    kept = []
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def serve() -> None:
            while True:
                try:
                    connection, _ = listener.accept()
                except OSError:
                    return
                kept.append(connection)
                answer(connection)

        threading.Thread(target=serve, daemon=True).start()
        yield listener.getsockname()[1]
    for connection in kept:
        connection.close()


def sends(data: bytes) -> Callable[[socket.socket], None]:
    return lambda connection: connection.sendall(data)


@in_one_test(
    "case",
    [
        (sends(b""), "accepts connections and says nothing for 0.2 s"),
        (sends(SETTINGS[:4]), "accepts connections and says nothing for 0.2 s"),
        (socket.socket.close, "accepts connections and closes them"),
        (sends(b"HTTP/1.1 400 Bad Request\r\n\r\n"), "does not speak gRPC"),
        (sends(b"SSH-2.0-OpenSSH_9.2p1\r\n"), "does not speak gRPC"),
        (sends(SETTINGS), ""),
    ],
)
def test_what_answers_at_an_address_is_known_in_a_moment(case) -> None:
    answer, told = case
    patience = 0.2 if "0.2 s" in told else 60.0  # on a busy machine an answer may be late
    with server(answer) as port:
        problem = problem_at("127.0.0.1", port, patience=patience)
    assert told in problem
    assert bool(told) == bool(problem)


def test_nobody_is_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    assert "refused" in problem_at("127.0.0.1", port)
    assert problem_at("127.0.0.1", 10**6)
    assert problem_at("no such host.invalid", 1)
    assert problem_at("\u00e9" * 100, 1)


JOIN = """
import sys
from er_gym.rollout.cluster import session
from er_gym.rollout.cluster.settings import RaySettings
session._JOIN_SECONDS = 3.0
with session.ray_backend(RaySettings(sys.argv[1]), print):
    pass
"""


@pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed")
@in_one_test(
    "case",
    [
        ("127.0.0.1:", "is no address of a Ray cluster: auto, HOST:PORT and ray://HOST:PORT are"),
        ("example", "is no address of a Ray cluster"),
        (f"127.0.0.1:{SILENT}", "says nothing for 0.2 s); give the address that `ray status` acc"),
        (f"ray://127.0.0.1:{SILENT}", "says nothing for 0.2 s); give the address"),
    ],
)
def test_what_is_no_ray_is_refused_before_ray_is_imported(case, monkeypatch) -> None:
    monkeypatch.setattr(session, "problem_at", partial(problem_at, patience=0.2))
    address, told = case
    with (
        server(sends(b"")) as port,
        pytest.raises(RayUnavailable) as refused,
        ray_backend(RaySettings(address.replace(SILENT, str(port))), print),
    ):
        pass
    assert told in str(refused.value)


@pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed")
def test_a_process_ends_where_what_greets_does_not_answer() -> None:
    with server(sends(SETTINGS)) as port:
        command = [sys.executable, "-c", JOIN, f"127.0.0.1:{port}"]
        environment = {name: value for name, value in os.environ.items() if "RAY" not in name}
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=200
        )
    lines = [line for line in done.stderr.splitlines() if "RayUnavailable: " in line]
    assert len(lines) == 1, f"{done.returncode}: {done.stderr}"
    (told,) = lines
    assert "cannot join the Ray cluster at 127.0.0.1:" in told
    assert "it has not let this machine join within 3 s" in told
    assert done.returncode == 1
