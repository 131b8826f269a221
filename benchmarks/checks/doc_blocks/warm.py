"""A process that has imported er-gym, and forks for each ``er-gym`` that a shell starts.

A fresh process spends more time on imports than most commands of the documentation take. A shell
with the environment of :func:`warm` finds this module's ``er-gym`` first. It hands its words,
folder, environment and streams to the process, and ends as the fork does. A fork is as good as a
fresh process as long as nothing was done in the parent but importing. So where a variable says
which parts of other packages are imported with er-gym, ``er-gym`` is a fresh process.
"""

from __future__ import annotations

import atexit
import contextlib
import fcntl
import importlib
import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from socketserver import BaseRequestHandler, ForkingMixIn, UnixStreamServer
from uuid import uuid4

from benchmarks.harness.processes import end_group

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
with socket.socket(socket.AF_UNIX) as server:
    server.connect({server!r})
    said = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
    socket.send_fds(server, [said], [0, 1, 2])
    code = int(server.recv(16) or 70)
sys.exit(code)
"""


@contextlib.contextmanager
def warm(folder: Path, environment: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """Start the process, and end it with all that it started.

    Args:
        folder: where the program ``er-gym`` is put; it is made.
        environment: of the shells; yields what they are to be given in its place.
    """
    folder.mkdir()
    client, name = folder / "er-gym", f"er-gym-{uuid4()}"
    client.write_text(_CLIENT.format(python=sys.executable, server=f"\0{name}"))
    client.chmod(0o755)
    command = [sys.executable, "-m", __spec__.name, name]
    path = os.pathsep.join((str(folder), str(Path(sys.executable).parent), environment["PATH"]))
    with subprocess.Popen(
        command, env=dict(environment), stdout=subprocess.PIPE, start_new_session=True
    ) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()  # it is ready
            yield {**environment, "PATH": path}
        finally:
            end_group(process.pid)


class _Server(ForkingMixIn, UnixStreamServer):
    parent = os.getppid()

    def service_actions(self) -> None:
        super().service_actions()
        if os.getppid() != self.parent:  # whoever started it has gone
            sys.exit()


class _Fork(BaseRequestHandler):
    """Does in a fork what ``er-gym`` does in a fresh process."""

    request: socket.socket

    def handle(self) -> None:
        said, streams, _, _ = socket.recv_fds(self.request, _LONGEST, 3)
        words, folder, environment = json.loads(said)
        os.setpgid(0, 0)
        # The end of the client, or of its shell, ends the fork and what it has started.
        fcntl.fcntl(self.request, fcntl.F_SETOWN, -os.getpid())
        fcntl.fcntl(self.request, fcntl.F_SETFL, os.O_ASYNC)
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
            os.close(stream)
        # Those of the parent remember its streams, such as whether they can be wound back.
        sys.stdin, sys.stdout, sys.stderr = map(os.fdopen, range(3), "rww")
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        sys.path[0] = os.path.dirname(environment["PATH"].partition(os.pathsep)[0])
        sys.argv = [str(Path(sys.executable).with_name("er-gym")), *words]
        from benchmarks.cli.main import main as er_gym

        code = 1
        try:
            er_gym(words)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        finally:
            # The server ends the fork without the rest of what Python does at its end.
            threading._shutdown()  # type: ignore[attr-defined]
            atexit._run_exitfuncs()
            sys.stdout.flush()
            sys.stderr.flush()
            self.request.sendall(str(code).encode())


if __name__ == "__main__":
    for module in _IMPORTED:
        importlib.import_module(module)
    with _Server(f"\0{sys.argv[1]}", _Fork) as serving:
        print("ready", flush=True)
        serving.serve_forever(0.2)
