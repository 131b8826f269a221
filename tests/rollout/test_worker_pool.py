"""Real processes, and real signals to them."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from threading import Thread, Timer

import pytest
from support import in_one_test, run_python

from er_gym.rollout.worker_pool import LostJob, WorkerSetupError, _serve, run_jobs

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
LONG = 120.0
"""Seconds after which what a test waits for will not come."""


@pytest.fixture
def jobs(monkeypatch):
    """The module of what workers do, where their processes find it too."""
    monkeypatch.syspath_prepend(HERE)
    return importlib.import_module("pool_jobs")


def test_every_job_is_done_once(jobs):
    results = list(run_jobs(jobs.Squarer, range(20), workers=3))
    assert sorted(results) == [(job, job * job) for job in range(20)]


@in_one_test("stderr", ["Display()", "Closed()"])
def test_workers_start_while_a_display_has_the_terminal(stderr):
    program = f"""
import io, sys
sys.path.insert(0, {str(HERE)!r})
from pool_jobs import Squarer
from er_gym.rollout.worker_pool import run_jobs

class Display(io.StringIO):
    fileno = lambda self: -1  # as Textual's, on which Inspect's display is built

class Closed(io.StringIO):
    fileno = lambda self: 999

if __name__ == "__main__":
    sys.stderr = shown = {stderr}
    print(list(run_jobs(Squarer, [3], workers=1)), sys.stderr is shown)
"""
    assert run_python(program).stdout.strip() == "[(3, 9)] True"


def test_no_jobs_start_no_process(jobs):
    assert list(run_jobs(jobs.no_such_engine, [], workers=3)) == []


def test_workers_are_other_processes_and_are_closed(jobs, tmp_path):
    list(run_jobs(partial(jobs.Closing, tmp_path), range(6), workers=2))
    pids = {int(path.name) for path in tmp_path.iterdir()}
    assert len(pids) == 2
    assert os.getpid() not in pids


def test_a_killed_worker_costs_one_try(jobs, tmp_path):
    results = dict(run_jobs(partial(jobs.Fragile, tmp_path, False), range(8), workers=2))
    assert results == {job: job for job in range(8)}
    tried = [path.name.split("-")[0] for path in tmp_path.iterdir()]
    assert sorted(tried) == [*"01233", *"4567"]  # no other job was tried again


def test_a_job_that_always_kills_is_given_up(jobs, tmp_path):
    results = dict(run_jobs(partial(jobs.Fragile, tmp_path, True), range(8), workers=2, tries=3))
    assert results.pop(3) == LostJob(tries=3, exitcode=-signal.SIGKILL)
    assert results == {job: job for job in (0, 1, 2, 4, 5, 6, 7)}
    assert len(list(tmp_path.glob("3-*"))) == 3


@pytest.mark.parametrize("when", ["at work", "with a result that nobody has read", "set up"])
def test_a_worker_whose_parent_hangs_up_ends_without_an_error(when):
    """On Ctrl-C the parent closes the pipe; a traceback of the worker would be on the terminal."""
    ours, theirs = multiprocessing.Pipe()
    closed = []

    class Job:
        def __init__(self):
            if when == "set up":
                ours.close()
                raise OSError("no engine")

        def __call__(self, job):
            if when == "at work":
                ours.close()
            else:
                Timer(0.1, ours.close).start()
            return job

        def close(self):
            closed.append(True)

    ours.send("job")
    _serve(theirs, Job)
    assert closed == ([] if when == "set up" else [True])


def test_a_worker_that_cannot_be_set_up_ends_it(jobs):
    with pytest.raises(WorkerSetupError, match="OSError: no such engine"):
        list(run_jobs(jobs.no_such_engine, range(4), workers=2))
    assert multiprocessing.active_children() == []


def test_leaving_early_ends_workers_at_once(jobs, tmp_path):
    started = time.monotonic()
    results = run_jobs(partial(jobs.Mixed, tmp_path), ["quick", "slow"], workers=2)
    assert next(results) == ("quick", "quick")
    wait_for(lambda: list(tmp_path.glob("began-*")))
    results.close()
    assert multiprocessing.active_children() == []
    assert list(tmp_path.glob("closed-*"))  # what they held was closed
    assert time.monotonic() - started < 30


def test_a_worker_goes_on_while_its_result_is_looked_at(jobs, tmp_path):
    results = run_jobs(partial(jobs.Mixed, tmp_path), ["quick", "slow"], workers=1)
    assert next(results) == ("quick", "quick")
    wait_for(lambda: list(tmp_path.glob("began-*")))
    results.close()


def test_a_worker_ends_where_python_can_raise_nothing(jobs, tmp_path, capfd):
    def end():
        wait_for(lambda: list(tmp_path.glob("began-*")))
        (began,) = tmp_path.glob("began-*")
        os.kill(int(began.name.removeprefix("began-")), signal.SIGTERM)

    Thread(target=end).start()
    ((_, lost),) = run_jobs(partial(jobs.LettingGo, tmp_path), [1], workers=1, tries=1)
    assert isinstance(lost, LostJob)
    assert lost.exitcode == 128 + signal.SIGTERM
    assert list(tmp_path.glob("closed-*"))
    assert "Traceback" not in capfd.readouterr().err


PARENT = """
from functools import partial
from pathlib import Path
from pool_jobs import Slow
from er_gym.rollout.worker_pool import run_jobs
if __name__ == "__main__":
    list(run_jobs(partial(Slow, Path({folder!r})), [1, 2], workers=2))
"""


@pytest.mark.parametrize(
    "signum", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=["KILL", "TERM", "INT"]
)
def test_workers_do_not_outlive_their_parent(tmp_path, signum):
    script = tmp_path / "parent.py"
    script.write_text(PARENT.format(folder=str(tmp_path)))
    parent = subprocess.Popen(
        [sys.executable, str(script)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(HERE)])},
        start_new_session=True,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for(lambda: len(list(tmp_path.glob("began-*"))) == 2)
        pids = [int(path.name.split("-")[1]) for path in tmp_path.glob("began-*")]
        if signum == signal.SIGINT:
            os.killpg(parent.pid, signum)  # as a terminal does: to the workers, too
        else:
            parent.send_signal(signum)
        _, stderr = parent.communicate(timeout=LONG)
        wait_for(lambda: not any(alive(pid) for pid in pids))
        assert len(list(tmp_path.glob("closed-*"))) == 2
        assert stderr.count("Traceback") == (signum == signal.SIGINT)  # the parent's own
    finally:
        parent.kill()


def alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"


def wait_for(condition) -> None:
    deadline = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)
