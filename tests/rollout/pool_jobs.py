"""The jobs of the workers in ``test_worker_pool``; a module that spawned processes can import."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


class Squarer:
    def __call__(self, job: int) -> int:
        return job * job


class Fragile:
    """Its process is killed by the job 3, the first time or always."""

    def __init__(self, folder: Path, always: bool) -> None:
        self.folder, self.always = folder, always

    def __call__(self, job: int) -> int:
        tries = self.folder / f"{job}-{os.getpid()}"
        tries.touch()
        if job == 3 and (self.always or len(list(self.folder.glob("3-*"))) == 1):
            os.kill(os.getpid(), signal.SIGKILL)
        return job


class Slow:
    """Says that it began, then takes a minute; and closes slowly, as an engine may."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __call__(self, job: int) -> int:
        (self.folder / f"began-{os.getpid()}").touch()
        time.sleep(60)
        return job

    def close(self) -> None:
        time.sleep(0.2)
        (self.folder / f"closed-{os.getpid()}").touch()


class Closing(Squarer):
    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def close(self) -> None:
        (self.folder / str(os.getpid())).touch()


class Mixed(Slow):
    def __call__(self, job: str) -> str:  # type: ignore[override]
        if job == "slow":
            super().__call__(0)
        return job


class LettingGo(Slow):
    """Is let go of for a minute: what is raised meanwhile is lost."""

    def __call__(self, job: int) -> int:
        Letting(self.folder)
        time.sleep(60)
        return job


class Letting:
    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __del__(self) -> None:
        (self.folder / f"began-{os.getpid()}").touch()
        time.sleep(60)


def no_such_engine() -> Squarer:
    raise OSError("no such engine")
