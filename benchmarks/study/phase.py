"""What a study consists of: phases, and the models that they measure."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Phase:
    """A step of a plan.

    Attributes:
        name: unique, such as ``2-exploration/sample``.
        command: the arguments of ``er-gym``.
        out: the directory that it writes, relative to the plan's.
        checks: each raises ValueError if the command would refuse what it is given
            (:mod:`benchmarks.study.checks`).
    """

    name: str
    command: tuple[str, ...]
    out: str
    checks: tuple[Callable[[], None], ...] = field(default=(), compare=False)

    def __str__(self) -> str:
        return shlex.join(("er-gym", *self.command))


@dataclass(frozen=True)
class Measurement:
    """A model that is measured: a rung of a ladder, or a row of an ablation.

    Attributes:
        name: of the rung or the row.
        runs: by the seed of the model's training, the run directory of its evaluation, relative to
            the study's.
        faults: the rate of faults.
    """

    name: str
    runs: Mapping[int, str]
    faults: float = 0.0
