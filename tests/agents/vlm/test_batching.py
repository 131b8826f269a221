"""Batching: many threads share a model, each gets its own result, and none waits for ever."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import pytest

from agents.vlm.chat import ModelError
from agents.vlm.clients.batching import SingleStep, SteppedJobs, batches
from er_gym.rollout.agent import CannotGoOn

LONG = 60.0  # seconds; only broken code waits so long
Outcome = str | type[Exception]
Batches = SteppedJobs[str, SingleStep[str, str], str]


class Model:
    """Says each job backwards, and remembers what came together, and in which thread."""

    def __init__(self, check: Callable[[Sequence[str]], None] = lambda jobs: None) -> None:
        self.calls: list[list[str]] = []
        self.threads: set[int] = set()
        self._check = check

    def __call__(self, jobs: Sequence[str]) -> list[str]:
        self.calls.append(list(jobs))
        self.threads.add(threading.get_ident())
        self._check(jobs)
        return [job[::-1] for job in jobs]

    @property
    def sizes(self) -> list[int]:
        return [len(call) for call in self.calls]


@pytest.fixture
def pool() -> Iterator[ThreadPoolExecutor]:
    with ThreadPoolExecutor(8) as made:
        yield made


def asked(pool: ThreadPoolExecutor, batcher: Batches, jobs: Sequence[str]) -> list[str | Exception]:
    """What becomes of jobs, each asked for by a thread of its own, all at once."""
    answers = [pool.submit(batcher.do, job) for job in jobs]
    return [each.exception(LONG) or each.result() for each in answers]  # type: ignore[misc]


def test_those_who_wait_are_served_together(pool: ThreadPoolExecutor) -> None:
    model = Model()
    batcher = batches(model, size=4, wait=LONG)  # a full batch goes at once
    for _ in range(3):
        assert asked(pool, batcher, ["ab", "cd", "ef", "gh"]) == ["ba", "dc", "fe", "hg"]
    batcher.close()
    assert model.sizes == [4, 4, 4]
    assert len(model.threads) == 1
    assert threading.get_ident() not in model.threads


def test_nobody_waits_for_others_longer_than_allowed() -> None:
    batcher = batches(Model(), size=4, wait=0.0)
    assert batcher.do("ab") == "ba"
    batcher.close()


def test_only_who_is_at_fault_fails(pool: ThreadPoolExecutor) -> None:
    def check(jobs: Sequence[str]) -> None:
        if "bad" in jobs:
            raise ValueError("no\nsuch job")

    model = Model(check)
    batcher = batches(model, size=4, wait=LONG)
    first, bad, *others = asked(pool, batcher, ["ab", "bad", "cd", "ef"])
    batcher.close()
    assert [first, *others] == ["ba", "dc", "fe"]
    assert isinstance(bad, ModelError)
    assert str(bad) == "ValueError: no such job"
    assert model.sizes == [4, 1, 1, 1, 1]


def test_what_does_not_fit_is_halved_and_stays_so(pool: ThreadPoolExecutor) -> None:
    def check(jobs: Sequence[str]) -> None:
        if len(jobs) > 2:
            raise MemoryError

    model = Model(check)
    batcher = batches(model, size=8, wait=LONG)
    jobs = [f"{number}x" for number in range(8)]
    assert asked(pool, batcher, jobs) == [job[::-1] for job in jobs]
    assert model.sizes == [8, 4, 2, 2, 2, 2]
    assert asked(pool, batcher, jobs) == [job[::-1] for job in jobs]
    batcher.close()
    assert model.sizes[6:] == [2, 2, 2, 2]


def test_what_does_not_fit_alone_fails() -> None:
    def check(jobs: Sequence[str]) -> None:
        raise MemoryError("too long")

    batcher = batches(Model(check), size=8, wait=0.0)
    with pytest.raises(ModelError, match="MemoryError: too long"):
        batcher.do("ab")
    batcher.close()


def test_what_ends_the_run_is_tried_once_and_told_all(pool: ThreadPoolExecutor) -> None:
    def check(jobs: Sequence[str]) -> None:
        raise CannotGoOn("the device is gone")

    model = Model(check)
    batcher = batches(model, size=3, wait=LONG)
    answers = asked(pool, batcher, ["ab", "cd", "ef"])
    batcher.close()
    assert [(type(each), str(each)) for each in answers] == [(CannotGoOn, "the device is gone")] * 3
    assert model.sizes == [3]


def test_a_result_too_few_fails_all_but_hangs_none(pool: ThreadPoolExecutor) -> None:
    batcher: Batches = batches(lambda jobs: [], size=2, wait=LONG)
    answers = asked(pool, batcher, ["ab", "cd"])
    batcher.close()
    assert [type(each) for each in answers] == [ModelError, ModelError]


def test_closing_serves_who_is_at_work_and_sends_the_rest_away(pool: ThreadPoolExecutor) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def check(jobs: Sequence[str]) -> None:
        begun.set()
        assert go_on.wait(LONG)

    model = Model(check)
    batcher = batches(model, size=1, wait=0.0)
    at_work = pool.submit(batcher.do, "ab")
    assert begun.wait(LONG)
    waiting = [pool.submit(batcher.do, job) for job in ("cd", "ef")]
    closing: Future[None] = pool.submit(batcher.close)
    while not batcher.closed:
        time.sleep(0.01)
    go_on.set()
    closing.result(LONG)
    assert at_work.result(LONG) == "ba"
    for each in waiting:
        with pytest.raises(CannotGoOn, match="closed"):
            each.result(LONG)
    assert model.calls == [["ab"]]
    batcher.close()  # twice does no harm


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_thread_that_dies_leaves_nobody_waiting(pool: ThreadPoolExecutor) -> None:
    def check(jobs: Sequence[str]) -> None:
        raise SystemExit

    batcher = batches(Model(check), size=2, wait=LONG)
    assert [type(each) for each in asked(pool, batcher, ["ab", "cd"])] == [CannotGoOn] * 2
    with pytest.raises(CannotGoOn):
        batcher.do("ef")
    batcher.close()


INTERRUPTED = """
import os, signal, threading, time
from agents.vlm.clients.batching import batches

begun, go_on, calls = threading.Event(), threading.Event(), []

def run(jobs):
    calls.append(jobs)
    begun.set()
    go_on.wait()
    return jobs

def interrupt():
    while batcher.waiting.empty():
        time.sleep(0.01)
    os.kill(os.getpid(), signal.SIGINT)

batcher = batches(run, size=1, wait=0.0)
threading.Thread(target=batcher.do, args=("first",), daemon=True).start()
begun.wait()
threading.Thread(target=interrupt).start()
try:
    batcher.do("second")
except KeyboardInterrupt:
    go_on.set()
    batcher.do("third")
    batcher.close()
    print(calls)
"""


def test_ctrl_c_ends_the_wait_and_its_job_is_not_done() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=LONG
    )
    assert (done.stdout, done.stderr) == ("[['first'], ['third']]\n", "")


def test_a_program_ends_that_does_not_close_it() -> None:
    program = """
from agents.vlm.clients.batching import batches
print(batches(lambda jobs: jobs, size=1, wait=0.0).do("ab"))
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=LONG
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "ab\n", "")
