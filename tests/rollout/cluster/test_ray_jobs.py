"""Jobs, and the environments of agents in this process, on a Ray that is started here."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial
from pathlib import Path

import agents_by_hand as by_hand
import gymnasium
import pytest
import ray_jobs
from support import ROOT

from er_gym.rollout.cluster.session import ray_backend
from er_gym.rollout.cluster.settings import RaySettings
from er_gym.rollout.env_pool import EnvLost, EnvPool
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import EXECUTORS, run
from er_gym.rollout.worker_backend import LOCAL_BACKEND
from er_gym.rollout.worker_pool import LostJob, WorkerSetupError
from er_gym.tasks.paper_format import read_tasks

ray = pytest.importorskip("ray", reason="Ray is not installed")


@pytest.fixture(scope="module")
def worker_backend():
    before = dict(os.environ)
    with ray_backend(RaySettings(cpus=0.1, memory=2**28), print) as ours:
        folder = Path(ray._private.worker._global_node.get_temp_dir_path())
        assert folder.exists()
        yield ours
    assert not folder.exists()
    assert dict(os.environ) == {**before, "PYTEST_CURRENT_TEST": os.environ["PYTEST_CURRENT_TEST"]}
    assert until(lambda: not any(_mentions(pid, folder) for pid in _descendants(os.getpid())))


def reset_for_ever(env, task):
    while True:
        env.reset(seed=0, options={"task": task})


def pids(results):
    return {pid for _, (_, pid) in results}


def is_alive(pid):
    try:
        return "ray::" in Path(f"/proc/{pid}/cmdline").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return False


def until(check, seconds=100):
    end = time.monotonic() + seconds
    while not check() and time.monotonic() < end:
        time.sleep(0.1)
    return check()


def test_every_job_is_done_once_and_those_that_kill_are_given_up(worker_backend):
    jobs = [*range(40), "die", *range(40, 80), "raise"]
    results = list(worker_backend.run_jobs(ray_jobs.Troubled, jobs, workers=2))
    lost = {job: result for job, result in results if isinstance(result, LostJob)}
    assert lost.keys() == {"die", "raise"}
    assert (lost["raise"].tries, lost["raise"].why) == (3, "KeyError: 'no such thing'")
    # Where Ray does not say which of its jobs a worker died of, that does not count against a job.
    assert 3 <= lost["die"].tries <= 5
    assert str(lost["die"]) == (
        f"the worker process died {lost['die'].tries} times, last: The actor is dead because its "
        "worker process has died"
    )
    assert sorted(job for job, _ in results if job not in lost) == list(range(80))
    assert all(result[0] == job for job, result in results if job not in lost)


def test_a_worker_that_cannot_be_made_is_the_same_error_as_here(worker_backend):
    for where in (LOCAL_BACKEND, worker_backend):
        with pytest.raises(WorkerSetupError, match=r"^OSError: no such engine$"):
            list(where.run_jobs(ray_jobs.no_such_engine, [1, 2], workers=2))


def test_a_worker_keeps_to_its_room(worker_backend):
    jobs = [(room, number) for number in range(30) for room in "ab"]
    results = worker_backend.run_jobs(
        ray_jobs.Troubled, jobs, workers=2, affinity_key=lambda job: job[0]
    )
    homes = {(pid, job[0]) for job, (_, pid) in results}
    assert len(homes) <= 3  # who has finished a room helps with the other


def test_a_worker_that_has_grown_is_replaced(worker_backend, capsys):
    jobs = ["grow", *range(6)]
    assert len(pids(worker_backend.run_jobs(ray_jobs.Troubled, jobs, workers=1))) == 2
    assert capsys.readouterr().out.count("give a larger --worker-memory") == 1


def test_leaving_early_ends_the_workers(worker_backend):
    results = worker_backend.run_jobs(ray_jobs.Troubled, [1, *["sleep"] * 5], workers=2)
    _, (_, pid) = next(results)
    assert is_alive(pid)
    results.close()
    assert until(lambda: not is_alive(pid))


@pytest.mark.parametrize("executor", sorted(EXECUTORS))
def test_a_run_is_the_same_as_on_this_machine(
    worker_backend, executor, tmp_path, manifest, tasks_file, monkeypatch
):
    tasks = read_tasks(tasks_file)[:2]
    changed = manifest.model_copy(update={"env": {"obs_mode": "text", "max_steps": 4}})
    records = []
    for name, where in (("here", LOCAL_BACKEND), ("ray", worker_backend)):
        directory = RunDirectory.create(tmp_path / name, changed)
        size = Parallelism(workers=2, concurrency=2, worker_backend=where)
        run(directory, tasks, by_hand.ending, executor=executor, parallelism=size)
        records.append([each.model_copy(update={"seconds": 0}) for each in directory.episodes()])
    assert records[0] == records[1]
    assert len(records[0]) == 2


def test_an_environment_whose_worker_dies_is_made_anew(worker_backend, tasks_file):
    task = read_tasks(tasks_file)[0]
    with EnvPool(1, 2, {"obs_mode": "text"}, worker_backend=worker_backend) as pool:
        env, other = pool.env(0), pool.env(1)
        _, info = env.reset(seed=0, options={"task": task})
        with pytest.raises(gymnasium.error.InvalidAction, match="is not an action"):
            env.step(10**9)
        stuck = threading.Timer(0.3, partial(ray.kill, env._worker._actor))
        stuck.start()
        with pytest.raises(EnvLost) as lost:
            reset_for_ever(env, task)
        assert lost.value.at_fault
        assert "killed" in lost.value.why
        with pytest.raises(EnvLost):
            other.step("observe")
        fresh = pool.env(0)
        _, again = fresh.reset(seed=0, options={"task": task})
        assert again["feedback"] == info["feedback"]


def test_nothing_is_left_of_a_ray_whose_process_is_ended():
    """What one that ends by itself leaves is looked at where ``worker_backend`` ends."""
    program = """
import os, signal, sys, time
import ray
from benchmarks.cli.errors import interrupted_by_sigterm
from er_gym.rollout.cluster.session import ray_backend
from er_gym.rollout.cluster.settings import RaySettings
with interrupted_by_sigterm(), ray_backend(RaySettings(), print) as worker_backend:
    print(ray._private.worker._global_node.get_temp_dir_path(), flush=True)
    for _ in worker_backend.run_jobs(lambda: time.sleep, [0.01] * 100, workers=1):
        os.killpg(0, signal.Signals[sys.argv[1]])
"""
    folders = []
    for ended_by in ("SIGKILL", "SIGTERM"):  # of all processes of its group
        command = [sys.executable, "-c", program, ended_by]
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, start_new_session=True
        )
        assert done.returncode != 0
        assert "KeyboardInterrupt" in done.stderr or ended_by != "SIGTERM"
        folders.append(Path(done.stdout.splitlines()[0]))
        assert folders[-1].exists() == (ended_by == "SIGKILL")
    assert not any(folder.exists() for folder in folders)  # the next one has tidied up
    assert until(lambda: not any(_mentions(pid, folders[0]) for pid in _descendants(1)))


def test_a_start_that_fails_half_way_leaves_no_process():
    program = """
import os
from pathlib import Path
from ray._private import services
from er_gym.rollout.cluster.session import RayUnavailable, ray_backend
from er_gym.rollout.cluster.settings import RaySettings

def stats():
    for each in Path("/proc").glob("[0-9]*/stat"):
        try:
            yield each.read_text().rpartition(")")
        except OSError:
            pass  # it has just ended

def servers():
    mine = [stat for stat in stats() if int(stat[2].split()[1]) == os.getpid()]
    return sum("gcs_server" in stat[0] for stat in mine)

def no_raylet(*args, **kwargs):
    print(servers())
    raise OSError("no raylet")

services.start_raylet = no_raylet
try:
    with ray_backend(RaySettings(), print):
        pass
except RayUnavailable as error:
    print(servers(), error)
"""
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "1\n1\n1\n0 Ray cannot be started here: no raylet\n"


def test_a_run_whose_ray_dies_ends_with_a_word():
    program = """
import sys, time
import ray
from er_gym.rollout.cluster.session import ray_backend
from er_gym.rollout.cluster.settings import RaySettings
with ray_backend(RaySettings(), lambda line: print(line, file=sys.stderr, flush=True)) as backend:
    node = ray._private.worker._global_node
    print(node.all_processes["raylet"][0].process.pid, node.get_temp_dir_path(), flush=True)
    for _ in backend.run_jobs(lambda: time.sleep, [0.01] * 10**6, workers=1):
        print("done", flush=True)
"""
    command = [sys.executable, "-c", program]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=ROOT, **pipes) as process:
        raylet, folder = process.stdout.readline().split()
        process.stdout.readline()  # a job is done
        os.kill(int(raylet), signal.SIGKILL)
        _, told = process.communicate(timeout=100)
    assert "the Ray that was started here has died: its raylet ended with -9" in told
    assert "the same command continues" in told
    assert process.returncode == 3
    assert not Path(folder).exists()


def _mentions(pid, folder):
    try:
        return str(folder).encode() in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def test_all_servers_listen_on_loopback_alone(worker_backend):
    family = _descendants(os.getpid())
    inodes = {inode for pid in family for inode in _sockets(pid)}
    listening = [
        address
        for table in ("tcp", "tcp6")
        for line in Path("/proc/net", table).read_text().splitlines()[1:]
        for _, address, _, state, *_, inode in [[*line.split()[:4], line.split()[9]]]
        if state == "0A" and inode in inodes
    ]
    assert len(listening) > 3
    loopback = ("0100007F:", "0000000000000000FFFF00000100007F:", "0" * 24 + "01000000:")
    assert [each for each in listening if not each.startswith(loopback)] == []


def _descendants(root):
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(status.parent.name)] = int(fields[1])
    found, new = set(), {root}
    while new:
        found |= new
        new = {pid for pid, parent in parents.items() if parent in new} - found
    return found


def _sockets(pid):
    try:
        links = [os.readlink(each) for each in Path(f"/proc/{pid}/fd").iterdir()]
    except OSError:
        return []
    return [link[8:-1] for link in links if link.startswith("socket:[")]
