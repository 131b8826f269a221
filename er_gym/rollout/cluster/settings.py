"""How er-gym uses a Ray cluster."""

from __future__ import annotations

from dataclasses import dataclass

GIB = 2**30


@dataclass(frozen=True)
class RaySettings:
    """How er-gym uses a Ray cluster.

    Attributes:
        address: of the cluster: ``auto``, ``HOST:PORT`` or ``ray://HOST:PORT``; ``""`` to start Ray
            on this machine, for this run alone.
        cpus: what a worker asks the cluster for, may be a fraction.
        memory: bytes that a worker asks the cluster for. A worker whose resident memory is larger
            is replaced between two jobs.
        shared_files: whether every node sees the files of this one under the same paths.

    Raises:
        ValueError: a number is out of its range.
    """

    address: str = ""
    cpus: float = 1.0
    memory: int = GIB
    shared_files: bool = False

    def __post_init__(self) -> None:
        if not self.cpus >= 0:
            raise ValueError(f"a worker cannot have {self.cpus} processors; give a number from 0")
        if self.memory < 2**26:
            raise ValueError(f"{self.memory} bytes are too few for a worker; give 64 MiB or more")
