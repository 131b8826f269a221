"""Two real runs of the same tasks, and a browser's requests to the monitor's pages."""

from __future__ import annotations

import http.client
import socket
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="needs the extra ui: pip install 'er-gym[ui]'")

import uvicorn
from fastapi.testclient import TestClient

from benchmarks.cli import main as cli
from benchmarks.monitor.app import make_app

LOCAL = "http://127.0.0.1:8010"
Visit = Callable[[Path], TestClient]


def play(out: Path, agent: str) -> None:
    """``er-gym bench`` over some tasks of ``mini``."""
    with pytest.raises(SystemExit) as left:
        cli.main(["bench", "--suite", "mini", "--agent", agent, "--limit", "8", "--out", str(out)])
    assert left.value.code == 0


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``oracle``, which succeeds, and ``random``, which does not."""
    folder = tmp_path_factory.mktemp("runs")
    for agent in ("oracle", "random"):
        play(folder / agent, agent)
    return folder


@pytest.fixture
def visit() -> Iterator[Visit]:
    """Opens the monitor over a folder, as a browser on this machine does."""
    opened: list[TestClient] = []

    def visit(folder: Path) -> TestClient:
        client = TestClient(make_app([folder]), base_url=LOCAL, follow_redirects=False)
        opened.append(client)
        return client

    yield visit
    for each in opened:
        each.close()


class Server:
    """The monitor over a folder, on a port of this machine."""

    def __init__(
        self, folder: Path, port: int = 0, play: Path | None = None, token: str = ""
    ) -> None:
        listener = socket.create_server(("127.0.0.1", port))
        self.port: int = listener.getsockname()[1]
        self._closing = threading.Event()
        app = make_app([folder], token, closing=self._closing, play=play)
        config = uvicorn.Config(app, log_level="error", access_log=False)
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, args=([listener],))
        self._thread.start()

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def raw(self, path: str) -> tuple[int, str]:
        """Ask for a path exactly as it is written; the status and the answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20)
        try:
            connection.putrequest("GET", path, skip_host=True)
            connection.putheader("Host", f"127.0.0.1:{self.port}")
            connection.endheaders()
            answer = connection.getresponse()
            return answer.status, answer.read().decode(errors="replace")
        finally:
            connection.close()

    def stop(self) -> None:
        self._closing.set()
        self._server.should_exit = True
        self._thread.join(20)


@pytest.fixture
def serve() -> Iterator[Callable[..., Server]]:
    """Starts servers that end with the test."""
    started: list[Server] = []

    def serve(folder: Path, port: int = 0, play: Path | None = None, token: str = "") -> Server:
        started.append(Server(folder, port, play, token))
        return started[-1]

    yield serve
    for each in started:
        each.stop()
