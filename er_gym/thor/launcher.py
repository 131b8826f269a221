"""The program that AI2-THOR's client launches to start the player."""

from __future__ import annotations

import os
import shlex
import sys
import threading
from hashlib import sha256
from pathlib import Path

from er_gym.writing import user_cache, write_atomic

EXECUTABLE = 0o755
_START = Path(__file__).with_name("start_player.py")


def thor_executable() -> str:
    """The executable for ``Controller(local_executable_path=…, x_display=":0")``.

    Returns:
        The path of a launcher for this Python and this er-gym. The launcher is written to the
        user's cache (``$XDG_CACHE_HOME`` or ``~/.cache``) if it is missing. The client splits the
        path as a shell would, so a path with spaces is quoted. If the cache cannot be written, it
        is the command that the launcher would run.
    """
    return executable_in(user_cache())


def executable_in(cache: Path) -> str:
    """As :func:`thor_executable`, with the launcher in another folder."""
    text = launcher()
    path = cache / f"player-{sha256(text.encode()).hexdigest()[:12]}"
    try:
        with _one_writer:
            if not (os.access(path, os.X_OK) and path.read_text() == text):
                cache.mkdir(parents=True, exist_ok=True)
                write_atomic(path, text, mode=EXECUTABLE)
    except OSError:
        return shlex.join(_command())
    return shlex.quote(str(path))


_one_writer = threading.Lock()
"""A thread that starts a process while another writes the launcher would hand it the open file, and
Linux runs no file that is open for writing ("Text file busy")."""


def _command() -> list[str]:
    return [sys.executable, str(_START)]


def launcher() -> str:
    """The text of a program that starts the player with this Python and this er-gym."""
    # A shell script, since a `#!` line allows neither spaces nor long paths. The shell starts at
    # once and knows its parent; Python may start after the parent's death.
    return (
        "#!/bin/sh\n"
        "# er-gym's player, which AI2-THOR's client starts in place of Unity's.\n"
        f'exec {shlex.join(_command())} -parent "$PPID" "$@"\n'
    )
