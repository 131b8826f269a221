"""A phase of a plan."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Phase:
    """A step of a plan.

    Attributes:
        name: unique, such as ``2-exploration/sample``.
        command: the arguments of ``er-gym``.
        out: the directory that it writes, relative to the plan's.
        checks: each raises ValueError if the command would refuse what it is given
            (:mod:`benchmarks.plan.checks`).
    """

    name: str
    command: tuple[str, ...]
    out: str
    checks: tuple[Callable[[], None], ...] = field(default=(), compare=False)

    def __str__(self) -> str:
        return shlex.join(("er-gym", *self.command))
