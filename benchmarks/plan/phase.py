"""A phase of a plan."""

from __future__ import annotations

import shlex
from dataclasses import dataclass


@dataclass(frozen=True)
class Phase:
    """A step of a plan.

    Attributes:
        name: unique, such as ``2-exploration/sample``.
        command: the arguments of ``er-gym``.
        out: the directory that it writes, relative to the plan's.
    """

    name: str
    command: tuple[str, ...]
    out: str

    def __str__(self) -> str:
        return shlex.join(("er-gym", *self.command))
