"""Real environments in real processes, some of which are killed."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.env_pool import EnvLost, EnvPool
from er_gym.rollout.play import error_with_location
from er_gym.rollout.worker_pool import WorkerSetupError
from er_gym.tasks.paper_format import read_tasks

LONG = 120.0
"""Seconds after which what a test waits for will not come."""
ACTIONS = ("observe", "navigate to CounterTop", Action("pickup", "Apple"), "dance", 1, "end")


@pytest.fixture
def task(tasks_file):
    return read_tasks(tasks_file)[0]


@pytest.fixture(scope="module")
def engines():
    """Slots 0 and 2 in one process, 1 and 3 in the other."""
    with EnvPool(2, 4, {"obs_mode": "text+state"}) as made:
        yield made


class Does:
    """What is done by whoever unpickles it, in the place of an action."""

    def __init__(self, function, *args):
        self.does = function, args

    def __reduce__(self):
        return self.does


KILLS = Does(signal.raise_signal, signal.SIGKILL)


def pid_of(env) -> int:
    """The process that an environment is in, by way of an action that it does not understand."""
    return int(env.step(Does(str, Does(os.getpid)))[-1]["action_text"])


def pids() -> set[int]:
    return {each.pid for each in multiprocessing.active_children()}


def wait_for(condition, seconds: float = LONG) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def began(engines: EnvPool, slot: int, task):
    env = engines.env(slot)
    env.reset(seed=0, options={"task": task})
    return env


def raised(function) -> Exception:
    with pytest.raises(Exception) as caught:  # noqa: PT011  (what it is, the tests look into)
        function()
    return caught.value


def at_once(*functions) -> list:
    """What they return or raise, called by as many threads in the same moment."""
    barrier, results = threading.Barrier(len(functions)), [None] * len(functions)

    def call(place, function):
        barrier.wait()
        try:
            results[place] = function()
        except Exception as error:
            results[place] = error

    threads = [threading.Thread(target=call, args=each) for each in enumerate(functions)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LONG)
    return results


# -- what an environment tells -------------------------------------------------------------------


def told(env, task) -> list:
    """All that ``reset`` and ``step`` return in an episode, arrays as something that compares."""

    def plain(value):
        if isinstance(value, np.ndarray):
            return value.dtype, value.shape, value.flags.writeable, value.tobytes()
        if isinstance(value, dict):
            return {name: plain(each) for name, each in value.items()}
        return value

    answers = [(*env.reset(seed=3, options={"task": task}), env.unwrapped.details)]
    answers += [(*env.step(action), env.unwrapped.details) for action in ACTIONS]
    return [[plain(part) for part in answer] for answer in answers]


def test_it_tells_what_an_environment_here_tells(engines, task):
    remote = told(engines.env(1), task)
    here = EmbodiedEnv((), obs_mode="text+state")
    assert remote == told(here, task)
    here.close()
    assert all(answer[-1]["task"] is task for answer in remote)
    succeeded = [answer[-2]["action_success"] for answer in remote[1:]]
    assert succeeded[:4] == [True, True, True, False]


def test_pictures_come_as_they_are(task):
    looks = {"obs_mode": "rgb", "width": 64, "height": 48}
    with EnvPool(1, 1, looks) as drawn:
        remote = told(drawn.env(0), task)
    here = EmbodiedEnv((), **looks)
    assert remote == told(here, task)
    here.close()
    _, shape, writeable, pixels = remote[1][-1]["views"]["left"]
    assert (shape, writeable) == ((48, 64, 3), True)
    assert len(set(pixels)) > 20


def test_the_environment_is_kept_until_it_is_closed(engines, task):
    began(engines, 3, task)
    engines.env(3).step("observe")  # still in that episode
    engines.env(3).close()
    with pytest.raises(gymnasium.error.ResetNeeded):
        engines.env(3).step("observe")
    began(engines, 3, task).step("observe")


def test_an_episode_goes_on_from_a_snapshot_in_another_slot(engines, task):
    one, other = began(engines, 3, task), engines.env(2)
    one.step("observe")
    saved = one.snapshot()
    _, info = other.restore(task, saved)
    assert (info["action"], other.details["task"]) == ("observe", task)
    expected, *_ = one.step("move forward")
    found, *_ = other.step("move forward")
    assert {name: str(each) for name, each in found.items()} == {
        name: str(each) for name, each in expected.items()
    }
    one.close()
    other.close()


# -- what goes wrong in it -----------------------------------------------------------------------


def test_what_it_raises_is_raised_here(engines, task):
    bad = {"task": replace(task, scene="FloorPlan999")}
    env = engines.env(0)
    remote = raised(lambda: env.reset(seed=0, options=bad))
    here = EmbodiedEnv((), obs_mode="text")
    local = raised(lambda: here.reset(seed=0, options=bad))
    here.close()
    assert type(remote) is type(local)
    assert "FloorPlan999" in str(remote)
    assert error_with_location(remote) == error_with_location(local)  # with file and line
    assert env.lost is None


def test_an_exception_that_cannot_travel_is_told(engines, task):
    env = began(engines, 0, task)
    of_its_own = "class Odd(Exception): ...\nraise Odd('well')"
    error = raised(lambda: env.step(Does(exec, of_its_own, {"__name__": "nowhere"})))
    assert (type(error), str(error)) == (RuntimeError, "Odd: well")
    assert env.step("observe")[-1]["action_success"]


def test_an_action_that_cannot_travel_disturbs_nobody(engines, task):
    env = began(engines, 0, task)
    assert "pickle" in str(raised(lambda: env.step(lambda: "observe")))
    assert env.step("observe")[-1]["action_success"]


def test_an_environment_that_cannot_be_made_is_told():
    with (
        EnvPool(1, 2, {"obs_mode": "smell"}) as none,
        pytest.raises(WorkerSetupError, match=r"ValueError: .*'smell'"),
    ):
        none.env(1)


# -- what goes wrong with its process ------------------------------------------------------------


def test_a_killed_process_costs_its_own_slots_and_is_started_once(engines, task):
    envs = [began(engines, slot, task) for slot in range(4)]
    first, second, *rest = (pid_of(env) for env in envs)
    assert rest == [first, second]
    os.kill(first, signal.SIGKILL)
    answers = at_once(*[lambda env=env: env.step("observe") for env in envs])
    assert [type(answer) for answer in answers] == [EnvLost, tuple, EnvLost, tuple]
    assert answers[0].exitcode == -signal.SIGKILL
    assert answers[0].at_fault  # it was at work on none, so this one is as likely as another
    assert [env.lost for env in envs] == [answers[0], None, answers[2], None]
    assert isinstance(raised(lambda: envs[0].step("observe")), EnvLost)  # for good

    again = at_once(*[lambda slot=slot: began(engines, slot, task) for slot in (0, 2)])
    (new,) = {pid_of(env) for env in again}
    assert pids() == {new, second}
    assert new != first


def test_who_kills_the_process_is_known(engines, task):
    guilty, neighbour = began(engines, 0, task), began(engines, 2, task)
    error = raised(lambda: guilty.step(KILLS))
    assert isinstance(error, EnvLost)
    assert (error.exitcode, error.at_fault) == (-signal.SIGKILL, True)
    assert str(error) == "the worker process died with exit code -9"
    error = raised(lambda: neighbour.step("observe"))
    assert (error.exitcode, error.at_fault) == (-signal.SIGKILL, False)
    began(engines, 0, task).step("observe")


def test_a_stuck_environment_is_given_up(engines, task):
    stuck, neighbour, other = (began(engines, slot, task) for slot in (1, 3, 0))
    before, engines.deadline = engines.deadline, 3.0
    try:
        error = raised(lambda: stuck.step(Does(time.sleep, 300)))
    finally:
        engines.deadline = before
    assert (error.exitcode, error.at_fault) == (-signal.SIGKILL, True)
    assert not raised(lambda: neighbour.step("observe")).at_fault
    other.step("observe")
    began(engines, 1, task).step("observe")


def test_a_process_is_replaced_unnoticed_and_ignores_ctrl_c(engines, task):
    """From its start, though another thread than the main one starts it."""
    os.kill(pid_of(began(engines, 0, task)), signal.SIGKILL)
    wait_for(lambda: len(pids()) == 1)
    known, envs = pids(), []
    thread = threading.Thread(target=lambda: envs.append(began(engines, 0, task)))
    thread.start()
    wait_for(lambda: pids() - known)
    (new,) = pids() - known
    os.kill(new, signal.SIGINT)  # before it can have imported what tells it to ignore that
    thread.join(LONG)
    os.kill(new, signal.SIGINT)
    assert pid_of(envs[0]) == new


def test_leaving_ends_what_is_under_way(task):
    with EnvPool(1, 2, {"obs_mode": "text"}) as left:
        busy = began(left, 0, task)
        pid = pid_of(busy)
        errors = []
        thread = threading.Thread(
            target=lambda: errors.append(raised(lambda: busy.step(Does(time.sleep, 300))))
        )
        thread.start()
    thread.join(LONG)
    assert pid not in pids()
    assert isinstance(errors[0], EnvLost)
    assert isinstance(raised(lambda: left.env(1)), EnvLost)
