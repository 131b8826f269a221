"""The fuzz's plans, steps, counts and report."""

from __future__ import annotations

import re
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from benchmarks.checks.fuzz_requests import PARAMETERS, Request
from benchmarks.harness.output import print_table
from benchmarks.terminal import echo
from er_gym.sim.scene import SCENE_NAMES

STEPS = 200
"""Actions in a run."""
_SHOWN = 3
"""The most problems of one kind that are printed; the others are only counted."""
_LONG = 600
"""Characters of a request or a message that are printed."""
_OTHER = "(none of them)"


@dataclass(frozen=True)
class FuzzPlan:
    """The plan of a fuzz; its runs do not depend on each other."""

    seed: int = 0
    actions: int = STEPS
    scenes: Sequence[str] = tuple(SCENE_NAMES)
    agents: int = 1

    @property
    def runs(self) -> int:
        return -(-self.actions // STEPS)

    def steps(self, run: int) -> int:
        """How many actions a run has: the last one may have fewer."""
        return min(STEPS, self.actions - run * STEPS)


@dataclass(frozen=True)
class FuzzStep:
    """An action of a run and its result."""

    run: int
    number: int
    scene: str
    request: Request
    error: str
    problems: list[str]
    seconds: float

    @property
    def name(self) -> str:
        name = self.request.get("action")
        return name if isinstance(name, str) and name in PARAMETERS else _OTHER

    def __str__(self) -> str:
        came = _short(repr(self.error)) if self.error else "done"
        said = "".join(f"\n  WRONG: {_short(problem)}" for problem in self.problems)
        where = f"run {self.run} step {self.number} in {self.scene}"
        return f"{where}: {_short(repr(self.request))}: {came}{said}"


def _short(text: str) -> str:
    """A text, shortened to its beginning and end if it is long."""
    return text if len(text) <= _LONG else f"{text[: _LONG - 100]} … {text[-97:]}"


@dataclass
class ActionCounts:
    """The counts and times of the actions of one name."""

    tries: int = 0
    successes: int = 0
    problems: int = 0
    seconds: float = 0.0
    slowest: float = 0.0

    def add(self, other: ActionCounts) -> None:
        """Add another tally."""
        self.tries += other.tries
        self.successes += other.successes
        self.problems += other.problems
        self.seconds += other.seconds
        self.slowest = max(self.slowest, other.slowest)

    def row(self) -> tuple[object, ...]:
        """As the table has them."""
        mean, slowest = self.seconds / max(1, self.tries), self.slowest
        counts = (self.tries, self.successes, self.tries - self.successes, self.problems)
        return (*counts, f"{1000 * mean:.2f}", f"{1000 * slowest:.2f}")


@dataclass
class FuzzReport:
    """The results of one or several runs; ``wrong`` are the steps with problems."""

    tallies: dict[str, ActionCounts] = field(default_factory=dict)
    wrong: list[FuzzStep] = field(default_factory=list)
    fingerprint: int = 0

    def add(self, other: FuzzReport) -> None:
        """Add another report; the order does not matter."""
        for name, tally in other.tallies.items():
            self.tallies.setdefault(name, ActionCounts()).add(tally)
        self.wrong += other.wrong
        self.fingerprint ^= other.fingerprint

    def count(self, step: FuzzStep) -> None:
        """Count a step."""
        one = ActionCounts(1, not step.error, len(step.problems), step.seconds, step.seconds)
        self.tallies.setdefault(step.name, ActionCounts()).add(one)
        if step.problems:
            self.wrong.append(step)
        said = f"{step.run} {step.request!r} {step.error}".encode(errors="replace")
        self.fingerprint = zlib.crc32(said, self.fingerprint)

    @property
    def total(self) -> ActionCounts:
        """The sum over all names."""
        total = ActionCounts()
        for tally in self.tallies.values():
            total.add(tally)
        return total


def show(report: FuzzReport, plan: FuzzPlan, seconds: float) -> int:
    """Print the problems, the table and a line that sums it up; returns the exit code."""
    kinds: Counter[str] = Counter()
    for step in sorted(report.wrong, key=lambda step: (step.run, step.number)):
        kind = _kind(step.problems[0])
        kinds[kind] += 1
        if kinds[kind] <= _SHOWN:
            echo(f"{step}\n  again: {repeat_command(plan, step.run)}")
    for kind, count in kinds.items():
        if count > _SHOWN:
            echo(f"{count - _SHOWN} more where: {kind}")
    head = ("action", "tries", "successes", "refusals", "problems", "mean ms", "slowest ms")
    rows = [*sorted(report.tallies.items()), ("all", report.total)]
    print_table("Actions played", head, ((name, *counts.row()) for name, counts in rows))
    total, bad = report.total, len(report.wrong)
    echo(
        f"{'BROKEN' if bad else 'ok'}: {total.tries} actions in {seconds:.1f} s "
        f"({100 * total.successes / max(1, total.tries):.1f} % succeeded), seed {plan.seed}, "
        f"fingerprint {report.fingerprint:08x}, problems {bad}"
    )
    return 1 if bad else 0


def _kind(problem: str) -> str:
    """The kind of a problem: its text without numbers, object ids and details."""
    return re.sub(r"\S+\|\S+|\b\d+(?= )", "…", problem).partition(": ")[0][:100]


def repeat_command(plan: FuzzPlan, run: int) -> str:
    """The command that repeats a run."""
    every = tuple(plan.scenes) == tuple(SCENE_NAMES)
    scenes = "" if every else f" --scenes {','.join(plan.scenes)}"
    agents = "" if plan.agents == 1 else f" --agents {plan.agents}"
    return (
        f"python -m benchmarks.checks.fuzz --actions {plan.actions} --seed {plan.seed}{scenes}"
        f"{agents} --run {run}"
    )
