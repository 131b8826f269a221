"""What a worker on another machine must have in common with the process that started it."""

from __future__ import annotations

import platform
import socket
import sys
from dataclasses import dataclass

from er_gym.version import __version__


@dataclass(frozen=True)
class Origin:
    """A process.

    Attributes:
        host: of its machine.
        python: the version of Python, ``3.11``.
        er_gym: the version of er-gym.
    """

    host: str
    python: str
    er_gym: str

    @classmethod
    def here(cls) -> Origin:
        """This process."""
        major, minor, *_ = sys.version_info
        return cls(socket.gethostname() or platform.node(), f"{major}.{minor}", __version__)

    def misfit(self, worker: Origin) -> str:
        """Why a worker cannot work for this process, and what to do; ``""`` if it can."""
        for what, ours, theirs in (
            ("Python", self.python, worker.python),
            ("er-gym", self.er_gym, worker.er_gym),
        ):
            if ours != theirs:
                return (
                    f"node {worker.host} has {what} {theirs}, this machine has {ours}; install "
                    "the same on all nodes"
                )
        return ""


def missing_there(worker: Origin, error: ImportError) -> str:
    """Why a worker cannot import what it needs, and what to do."""
    return (
        f"node {worker.host} cannot import {error.name or error}; install er-gym {worker.er_gym} "
        "there with the extras that this run needs"
    )
