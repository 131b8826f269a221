"""Runs a command, and ends it and all its child processes once standard input ends.

``python guard.py COMMAND…``: the starting process holds the other end of a pipe as the guard's
input. However that process ends, SIGKILL included, the kernel closes its end of the pipe, so no
process is left behind. The guard is run by its path and needs only the standard library.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time

GRACE = 15.0
"""Seconds that the command has to end by itself."""


def main(argv: list[str]) -> int:
    """Run the command until it ends or standard input ends.

    Returns:
        Its exit code; 128 and the signal's number if a signal ended it; 127 if it cannot be run.
    """
    try:
        child = subprocess.Popen(argv, stdin=subprocess.DEVNULL, start_new_session=True)
    except OSError as error:
        print(f"{argv[0]} cannot be run: {error}", file=sys.stderr)
        return 127
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, lambda *_: _signal(child.pid, signal.SIGTERM))
    threading.Thread(target=_end_with_input, args=(child.pid,), daemon=True).start()
    # Not reaped yet, its number is its group's and nobody else's.
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    _signal(child.pid, signal.SIGKILL)
    code = child.wait()
    return code if code >= 0 else 128 - code


def _end_with_input(group: int) -> None:
    while os.read(0, 1024):
        pass
    _signal(group, signal.SIGTERM)
    time.sleep(GRACE)
    _signal(group, signal.SIGKILL)


def _signal(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
