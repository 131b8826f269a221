"""er-gym imports and plays without what Python has on Linux alone, and without OpenCV."""

from __future__ import annotations

import json
from pathlib import Path

from support import run_python

AS_ELSEWHERE = """
import asyncio, concurrent.futures.process, multiprocessing.popen_spawn_posix
import os, shutil, signal, subprocess, sys, tempfile
import ai2thor.util.lock, click, filelock, numpy, rich.console  # which have branches of their own
sys.modules["cv2"] = None  # ai2thor requires a cv2 that needs libGL, which many machines lack
for module in ("fcntl", "grp", "pty", "pwd", "readline", "resource", "termios", "tty"):
    sys.modules[module] = None
for module, names in {
    os: "O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK chown fchown fork geteuid getuid killpg mkfifo"
        " pread pwrite register_at_fork sched_getaffinity setsid statvfs sysconf uname waitid",
    signal: "SIGHUP SIGKILL SIGUSR1 SIGUSR2 pthread_sigmask setitimer sigwait",
}.items():
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
"""
IMPORT = """
import er_gym
import agents, benchmarks.cli.main, er_gym.rollout.runner, er_gym.thor.player_install
import agents.factory
import benchmarks.scoring.report, er_gym.data.collection, er_gym.sim.transports
"""
PLAY = """
from pathlib import Path
from benchmarks.cli.main import main
main(["bench", "--suite", "mini", "--agent", "random", "--limit", "1", "--out", sys.argv[1]])
"""


def test_er_gym_imports_and_plays_without_what_only_linux_has(tmp_path: Path) -> None:
    run_python(AS_ELSEWHERE + IMPORT + PLAY, str(tmp_path / "run"))
    (episode,) = (tmp_path / "run" / "episodes").iterdir()
    assert json.loads(episode.read_bytes())["agent"]
