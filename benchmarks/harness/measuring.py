"""Measures several ways in turn, by the clock and by the processor's time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from benchmarks.harness.output import progress

Name = TypeVar("Name")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Spent:
    """Seconds by the clock and of this process's processor time."""

    clock: float
    processor: float


def timed(do: Callable[[], object]) -> Spent:
    """Do something once, and see how long it takes."""
    clock, processor = time.perf_counter(), time.process_time()
    do()
    return Spent(time.perf_counter() - clock, time.process_time() - processor)


def in_turns(
    ways: Mapping[Name, Callable[[], Result]], rounds: int, what: str = "rounds"
) -> dict[Name, list[Result]]:
    """What each way gives, once a round: a busy machine slows all alike.

    Every other round goes the other way round.
    """
    found: dict[Name, list[Result]] = {name: [] for name in ways}
    turns = [turn for number in range(rounds) for turn in [*ways.items()][:: 1 - 2 * (number % 2)]]
    for name, measure in progress(turns, what):
        found[name].append(measure())
    return found


def per_second(do: Callable[[], object], seconds: float) -> float:
    """How often something can be done in a second, tried for so many."""
    count, start = 0, time.perf_counter()
    while (took := time.perf_counter() - start) < seconds or not count:
        do()
        count += 1
    return count / took
