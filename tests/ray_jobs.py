"""Jobs for actors; a module that they can import."""

from __future__ import annotations

import os
import signal
import time


class Troubled:
    """Does what the job says: a number is returned with the process that had it."""

    def __init__(self) -> None:
        self._ballast = b""

    def __call__(self, job):
        if job == "die":
            os.kill(os.getpid(), signal.SIGKILL)
        if job == "raise":
            raise KeyError("no such thing")
        if job == "grow":
            self._ballast = bytes(range(256)) * 2**21
        if job == "sleep":
            time.sleep(60)
        return job, os.getpid()


def no_such_engine():
    raise OSError("no such engine")
