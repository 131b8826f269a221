"""A process that has imported er-gym, and forks for each ``er-gym`` that a shell starts.

A fresh process spends more time on imports than most commands of the documentation take. A shell
that is given :attr:`Warm.environment` finds this module's ``er-gym`` first. It hands its words,
folder, environment and streams to the process, and ends as the fork does. A fork is as good as a
fresh process as long as nothing was done in the parent but importing. So where a variable says
which parts of other packages are imported with er-gym, ``er-gym`` is a fresh process.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_SOCKET = "DOC_BLOCKS_SOCKET"
_LONGEST = 1 << 17
_IMPORTED = (
    "benchmarks.cli.main",
    "benchmarks.vlm_run",
    "benchmarks.scoring.report",
    "benchmarks.scoring.tables",
    "er_gym.envs.embodied_env",
    "er_gym.rollout.runner",
    "er_gym.tasks.generate",
)
_CLIENT = """#!{python} -IS
import json, os, socket, sys
if any(name.startswith("ER_GYM_") for name in os.environ):
    os.execv({python!r}, [{python!r}, "-m", "benchmarks.cli", *sys.argv[1:]])
asked, answer = socket.socketpair()
said = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
with socket.socket(fileno=int(os.environ[{socket!r}])) as server:
    socket.send_fds(server, [said], [0, 1, 2, answer.fileno()])
answer.close()
code = int(asked.recv(16) or 70)
sys.exit(code if code >= 0 else 128 - code)
"""


@dataclass(frozen=True)
class Warm:
    """A running process. ``environment`` is for shells; ``handle`` must stay open in them."""

    environment: Mapping[str, str]
    handle: int


@contextlib.contextmanager
def warm(folder: Path, environment: Mapping[str, str]) -> Iterator[Warm]:
    """Start the process, and end it with all that it started.

    Args:
        folder: where the program ``er-gym`` is put; it is made.
        environment: of the shells.
    """
    folder.mkdir()
    client = folder / "er-gym"
    client.write_text(_CLIENT.format(python=sys.executable, socket=_SOCKET))
    client.chmod(0o755)
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    with ours, theirs:
        process = subprocess.Popen(
            [sys.executable, "-m", __spec__.name, str(theirs.fileno())],
            pass_fds=[theirs.fileno()],
            env=dict(environment),
            stdin=subprocess.PIPE,  # its end ends the process
        )
        path = os.pathsep.join((str(folder), str(Path(sys.executable).parent), environment["PATH"]))
        given = {**environment, "PATH": path, _SOCKET: str(ours.fileno())}
        try:
            yield Warm(given, ours.fileno())
        finally:
            assert process.stdin is not None
            process.stdin.close()
            process.wait()


def main(handle: int) -> None:
    """Fork for each request. A fork goes on from here as its command would, and ends like it."""
    for name in _IMPORTED:
        importlib.import_module(name)
    request = _serve(socket.socket(fileno=handle))
    if request is not None:
        _become(*request)


def _become(words: list[str], folder: str, environment: Mapping[str, str]) -> None:
    """Do in this process, whose streams are in place, what ``er-gym`` does in a fresh one."""
    # Those of the parent remember what its streams were, such as whether they can be wound back.
    sys.stdin, sys.stdout, sys.stderr = map(os.fdopen, range(3), "rww")
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.path[0] = os.path.dirname(environment["PATH"].partition(os.pathsep)[0])
    sys.argv = [str(Path(sys.executable).with_name("er-gym")), *words]
    from benchmarks.cli.main import main as er_gym

    er_gym(words)  # ends this process


def _serve(server: socket.socket) -> tuple[list[str], str, dict[str, str]] | None:
    """The request of a fork, in the fork; None in the parent, once nobody needs it any more."""
    running: dict[int, tuple[int, socket.socket]] = {}
    with selectors.DefaultSelector() as waiting:
        waiting.register(0, selectors.EVENT_READ, None)
        waiting.register(server, selectors.EVENT_READ, server)
        while True:
            for key, _ in waiting.select():
                if key.data is None:
                    for pid, _ in running.values():
                        _kill(pid)
                    return None
                if key.data is server:
                    request = _accepted(server, waiting, running)
                    if request is not None:
                        return request
                elif key.fd in running:
                    _ended(key.fd, waiting, running)
                elif key.fileobj.recv(1) == b"":  # type: ignore[union-attr]
                    _kill(key.data)  # the shell's er-gym was killed
                    waiting.unregister(key.fileobj)


def _accepted(
    server: socket.socket,
    waiting: selectors.BaseSelector,
    running: dict[int, tuple[int, socket.socket]],
) -> Any:
    said, streams, _, _ = socket.recv_fds(server, _LONGEST, 4)
    pid = os.fork()
    if pid == 0:
        os.setsid()
        for number, stream in enumerate(streams[:3]):
            os.dup2(stream, number)
        for stream in streams:
            os.close(stream)
        return json.loads(said)
    for stream in streams[:3]:
        os.close(stream)
    answer = socket.socket(fileno=streams[3])
    watch = os.pidfd_open(pid)
    running[watch] = pid, answer
    waiting.register(watch, selectors.EVENT_READ, watch)
    waiting.register(answer, selectors.EVENT_READ, pid)
    return None


def _ended(
    watch: int, waiting: selectors.BaseSelector, running: dict[int, tuple[int, socket.socket]]
) -> None:
    pid, answer = running.pop(watch)
    _, status = os.waitpid(pid, 0)
    waiting.unregister(watch)
    os.close(watch)
    with contextlib.suppress(KeyError):
        waiting.unregister(answer)
    with contextlib.suppress(OSError):
        answer.send(str(os.waitstatus_to_exitcode(status)).encode())
    answer.close()


def _kill(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)


if __name__ == "__main__":
    main(int(sys.argv[1]))
