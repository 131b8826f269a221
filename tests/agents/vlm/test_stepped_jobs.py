"""Jobs of many steps share a thread; they join, end and fail each for itself."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import pytest

from agents.vlm.chat import ModelError
from agents.vlm.clients.batching import SteppedJobs
from er_gym.rollout.agent import CannotGoOn

LONG = 60.0  # seconds; only broken code waits so long


@dataclass
class Count:
    """A job: to count to a number."""

    to: int
    at: int = 0


def counter(
    check: Callable[[Sequence[Count]], object] = lambda counts: None, size: int = 4
) -> SteppedJobs[int, Count, int]:
    """Counts; ``check`` may spoil a step."""

    def step(counts: Sequence[Count]) -> None:
        check(counts)
        for each in counts:
            each.at += 1

    return SteppedJobs(Count, step, lambda c: c.at if c.at == c.to else None, size)


def outcomes(jobs: SteppedJobs[int, Count, int], asked: Sequence[int]) -> list[int | str]:
    """What many threads get at once."""

    def one(to: int) -> int | str:
        try:
            return jobs.do(to)
        except (ModelError, CannotGoOn) as error:
            return f"{type(error).__name__}: {error}"

    with ThreadPoolExecutor(len(asked)) as pool:
        return list(pool.map(one, asked, timeout=LONG))


def test_jobs_join_and_leave_at_any_step() -> None:
    met: list[list[int]] = []
    asked = [300, 200, 1, 2, 3, 150, 5, 6]

    def check(counts: Sequence[Count]) -> None:
        until = time.monotonic() + LONG
        while (
            not met and jobs.waiting.qsize() + len(counts) < len(asked) and time.monotonic() < until
        ):
            time.sleep(0.001)  # until all have asked
        met.append([each.at for each in counts])

    jobs = counter(check, size=3)
    assert outcomes(jobs, asked) == asked
    assert max(map(len, met)) == 3
    assert len(met) < sum(asked)
    assert any(0 in each and max(each) > 0 for each in met)  # one begins while another goes on
    jobs.close()


def test_a_faulty_job_fails_alone() -> None:
    def check(counts: Sequence[Count]) -> None:
        if any(each.to == 13 and each.at == 5 for each in counts):
            raise ValueError("thirteen")

    jobs = counter(check)
    assert outcomes(jobs, [50, 13, 60]) == [50, "ModelError: ValueError: thirteen", 60]
    assert jobs.do(7) == 7
    jobs.close()


def test_what_does_not_fit_into_memory_is_halved() -> None:
    sizes: list[int] = []

    def check(counts: Sequence[Count]) -> None:
        sizes.append(len(counts))
        if len(counts) > 2:
            raise MemoryError("too many")

    jobs = counter(check, size=8)
    asked = list(range(200, 208))
    assert outcomes(jobs, asked) == asked
    failed = [size for size in sizes if size > 2]
    assert all(after <= before // 2 for before, after in pairwise(failed))
    jobs.close()


def test_one_that_does_not_fit_by_itself_fails() -> None:
    def check(counts: Sequence[Count]) -> None:
        raise MemoryError("too long")

    jobs = counter(check)
    assert outcomes(jobs, [3, 4]) == ["ModelError: MemoryError: too long"] * 2
    jobs.close()


def test_all_end_where_none_can_go_on() -> None:
    def check(counts: Sequence[Count]) -> None:
        if len(counts) == 3:
            raise CannotGoOn("no device")

    jobs = counter(check, size=3)
    assert outcomes(jobs, [10**9] * 3) == ["CannotGoOn: no device"] * 3
    jobs.close()


def test_closing_sends_all_away() -> None:
    begun = threading.Event()
    jobs = counter(lambda counts: begun.set(), size=1)
    with ThreadPoolExecutor(3) as pool:
        waiting = [pool.submit(jobs.do, 10**9) for _ in range(3)]
        assert begun.wait(LONG)
        jobs.close()
        for each in waiting:
            with pytest.raises(CannotGoOn, match="closed"):
                each.result(LONG)
    with pytest.raises(CannotGoOn, match="closed"):
        jobs.do(1)
