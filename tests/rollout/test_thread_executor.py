"""Real episodes, several at once; agents that wait, fail and kill; real signals."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from agents import Decision, make_agent
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout import thread_executor
from er_gym.rollout.agent import CannotGoOn
from er_gym.rollout.events import EpisodeEnded
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import RunSummary, Stopped, run
from er_gym.rollout.worker_pool import WorkerSetupError
from er_gym.tasks.paper_format import read_tasks

ROOT = Path(__file__).parents[2]
LONG = 120.0
"""Seconds after which what a test waits for will not come."""


@pytest.fixture
def tasks(tasks_file):
    """Seven."""
    return read_tasks(tasks_file)


@pytest.fixture
def many(tasks):
    return [replace(tasks[n % 7], id=f"{tasks[n % 7].id}-{n}") for n in range(64)]


@pytest.fixture
def new_run_directory(tmp_path, manifest):
    """Makes a run_directory for a run in short episodes."""

    def make(**env) -> RunDirectory:
        changed = {"agent": "random", "env": {"obs_mode": "text", "max_steps": 4, **env}}
        return RunDirectory.create(tmp_path / "run", manifest.model_copy(update=changed))

    return make


@pytest.fixture
def run_directory(new_run_directory):
    return new_run_directory()


class Agent:
    """Ends the episode at once; tests make it do something else."""

    obs_mode = "text"

    def __init__(self, act=lambda: "end") -> None:
        self._act = act

    def reset(self, task, obs, info):
        pass

    def act(self, obs, info):
        return Decision(self._act())


def ending(task, seed):
    return Agent()


def at_random(task, seed):
    return make_agent("random", seed=seed)


class Kills:
    """In the place of an action: kills the process that it is sent to."""

    def __reduce__(self):
        return signal.raise_signal, (signal.SIGKILL,)


class Leaving:
    """An agent that leaves no files, but says when it is asked for them."""

    attachment_folders = ()

    def __init__(self, agent, keep) -> None:
        self._agent, self._keep = agent, keep
        self.obs_mode, self.reset, self.act = agent.obs_mode, agent.reset, agent.act

    def attachments(self, episode, stem):
        self._keep(episode, self._agent)
        return {}


def run_threaded(
    run_directory,
    tasks,
    make,
    *,
    workers=1,
    concurrency=8,
    on_episode=lambda event: None,
    keep=None,
) -> RunSummary:
    """Play in threads; hear of episodes that end, and of what agents are asked to leave."""

    def listen(event):
        if isinstance(event, EpisodeEnded):
            on_episode(event)

    def make_leaving(task, seed):
        agent = make(task, seed)
        return agent if keep is None else Leaving(agent, keep)

    parallelism = Parallelism(workers, concurrency)
    return run(
        run_directory,
        tasks,
        make_leaving,
        executor="threads",
        parallelism=parallelism,
        listeners=[listen],
    )


def kept(run_directory: RunDirectory) -> list[str]:
    return sorted(each.task_id for each in run_directory.episodes())


def ids(tasks) -> list[str]:
    return sorted(task.id for task in tasks)


def no_process() -> bool:
    return multiprocessing.active_children() == []


def wait_for(condition) -> None:
    deadline = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


# -- what is played ------------------------------------------------------------------------------


def test_what_is_played_is_what_is_played_here(run_directory, tasks, monkeypatch):
    """The random agent, because it would show if anything but the task's seed mattered."""
    env = EmbodiedEnv((), **run_directory.manifest.env)
    here = []
    for task in tasks:
        seed = episode_seed(0, task.id)
        agent = at_random(task, seed)
        played = play_episode(env, agent, task, seed, agent_name="random")
        here.append(played.model_copy(update={"seconds": 0.0}))
    env.close()

    talks, seen = [], []

    def keep(episode, agent):
        known = episode.task_id in kept(run_directory)
        talks.append((episode.task_id, known, threading.current_thread()))

    def on_episode(episode):
        seen.append(
            (episode.task_id, episode.task_id in kept(run_directory), threading.current_thread())
        )

    outcome = run_threaded(
        run_directory, tasks, at_random, workers=2, concurrency=3, keep=keep, on_episode=on_episode
    )
    assert outcome == RunSummary(7, 0, ())
    assert [each.model_copy(update={"seconds": 0.0}) for each in run_directory.episodes()] == here
    assert sorted(each[:2] for each in talks) == [(each, False) for each in ids(tasks)]
    assert sorted(each[:2] for each in seen) == [(each, True) for each in ids(tasks)]
    assert {thread for *_, thread in seen} == {threading.main_thread()}
    assert threading.main_thread() not in {thread for *_, thread in talks}

    monkeypatch.setattr(thread_executor, "EnvPool", None)  # no process is started
    assert run_threaded(run_directory, tasks, at_random) == RunSummary(0, 7, ())


def test_a_slow_reply_stops_nobody(run_directory, many):
    seen = []
    others_are_done = threading.Event()

    def slow():
        assert others_are_done.wait(LONG)
        return "end"

    def on_episode(episode):
        seen.append(episode.task_id)
        if len(seen) == 30:
            others_are_done.set()

    outcome = run_threaded(
        run_directory,
        many[:31],
        lambda task, seed: Agent(slow) if task.id == "paper-0-0" else Agent(),
        concurrency=3,
        on_episode=on_episode,
    )
    assert outcome == RunSummary(31, 0, ())
    assert seen[-1] == "paper-0-0"
    assert ids(many[:31]) == sorted(seen)


# -- what goes wrong -----------------------------------------------------------------------------


def test_killed_processes_lose_and_repeat_nothing(run_directory, many):
    """All are killed while episodes are under way, twice: no episode can lose three."""
    made, talks = Counter(), []

    def kill_all():
        for each in multiprocessing.active_children():
            os.kill(each.pid, signal.SIGKILL)
        return "observe"

    def make(task, seed):
        made[task.id] += 1
        kills = task.id in ("paper-6-20", "paper-5-40") and made[task.id] == 1
        return Agent(kill_all) if kills else at_random(task, seed)

    seen = []
    outcome = run_threaded(
        run_directory,
        many,
        make,
        workers=2,
        concurrency=8,
        on_episode=lambda episode: seen.append(episode.task_id),
        keep=lambda episode, agent: talks.append(episode.task_id),
    )
    assert outcome == RunSummary(64, 0, ())
    assert sorted(seen) == sorted(talks) == kept(run_directory) == ids(many)
    assert made["paper-6-20"] >= 2
    assert made["paper-5-40"] >= 2


def test_who_kills_the_process_is_given_up_and_the_others_are_not(run_directory, tasks):
    """Both others are in the middle of an episode in the same process each time it dies."""
    made, talks, under_way = Counter(), [], set()
    given_up = threading.Event()

    def kill():
        wait_for(lambda: len(under_way) == 2)
        under_way.clear()
        return Kills()

    def make(task, seed):
        def wait():
            deaths = made["paper-0"]
            under_way.add(task.id)
            wait_for(lambda: made["paper-0"] > deaths or given_up.is_set())
            return "end"

        made[task.id] += 1
        return Agent(kill if task.id == "paper-0" else wait)

    outcome = run_threaded(
        run_directory,
        tasks[:3],
        make,
        concurrency=3,
        on_episode=lambda episode: given_up.set(),
        keep=lambda episode, agent: talks.append(episode.task_id),
    )
    (lost,) = outcome.crashed
    assert (lost.task_id, lost.steps) == ("paper-0", [])
    assert lost.error == "the worker process died 3 times, last with exit code -9"
    assert made == {"paper-0": 3, "paper-1": 4, "paper-2": 4}
    assert kept(run_directory) == sorted(talks) == ids(tasks[:3])


def test_crashes_are_recorded_and_do_not_end_a_run(run_directory, tasks):
    def make(task, seed):
        if task.id == "paper-1":
            raise ValueError("no such model")
        return Agent(lambda: [].pop()) if task.id == "paper-2" else Agent()

    bad = replace(tasks[0], scene="FloorPlan999")
    talks = []
    outcome = run_threaded(
        run_directory,
        [bad, *tasks[1:]],
        make,
        concurrency=1,
        keep=lambda episode, _: talks.append(episode.task_id),
    )
    errors = {each.task_id: each.error for each in outcome.crashed}
    assert errors.keys() == {"paper-0", "paper-1", "paper-2"}
    assert "FloorPlan999" in errors["paper-0"]
    assert errors["paper-1"].startswith("ValueError: no such model (")
    assert errors["paper-2"].startswith("IndexError: pop from empty list (")
    assert talks == ["paper-0", *(f"paper-{n}" for n in range(2, 7))]


def test_an_environment_that_cannot_be_made_ends_it(new_run_directory, tasks):
    with pytest.raises(WorkerSetupError, match="'smell'"):
        run_threaded(new_run_directory(obs_mode="smell"), tasks, ending, concurrency=3)
    assert no_process()


def test_what_cannot_be_kept_ends_it(run_directory, tasks, monkeypatch):
    def attach(task_id, attachments, folders):
        raise OSError("disk full")

    monkeypatch.setattr(run_directory, "attach", attach)
    with pytest.raises(OSError, match="disk full"):
        run_threaded(run_directory, tasks, ending)
    assert kept(run_directory) == []
    assert no_process()


# -- how it is ended -----------------------------------------------------------------------------


def test_an_agent_that_cannot_go_on_stops_the_run(new_run_directory, tasks):
    """In flight: one that is over with its reply, one that is not, one that cannot go on."""
    run_directory = new_run_directory(max_steps=100_000)
    in_flight = threading.Barrier(3)
    spent = threading.Event()
    agents, talks = set(), []

    def cannot():
        in_flight.wait(LONG)
        spent.set()
        raise CannotGoOn("the budget is spent")

    def reply(action):
        def act():
            if not spent.is_set():
                in_flight.wait(LONG)
            assert spent.wait(LONG)
            return action()

        return act

    turns = iter(range(100_000))
    plays = {
        "paper-1": cannot,
        "paper-2": reply(lambda: "end"),
        "paper-3": reply(lambda: ("observe", "move forward")[next(turns) % 2]),
    }

    def make(task, seed):
        agents.add(task.id)
        return Agent(plays.get(task.id, lambda: "end"))

    with pytest.raises(Stopped, match=r"^the budget is spent$") as stopped:
        run_threaded(
            run_directory,
            tasks,
            make,
            concurrency=3,
            keep=lambda episode, agent: talks.append(episode.task_id),
        )
    assert stopped.value.summary == RunSummary(2, 0, ())
    assert talks == ["paper-0", "paper-2"]
    assert kept(run_directory) == ["paper-0", "paper-2"]
    assert agents == {"paper-0", "paper-1", "paper-2", "paper-3"}
    assert no_process()
    assert run_threaded(run_directory, tasks, ending) == RunSummary(5, 2, ())


def test_a_refused_key_ends_it_before_anything_is_played(run_directory, tasks):
    def make(task, seed):
        raise CannotGoOn("the key is refused")

    with pytest.raises(CannotGoOn, match="the key is refused"):
        run_threaded(run_directory, tasks, make, concurrency=4)
    assert kept(run_directory) == []


def test_an_interrupt_waits_for_no_reply_and_loses_no_episode(run_directory, tasks, monkeypatch):
    """It comes while an episode is being written. What an agent says later is nobody's business."""
    waiting, replied = threading.Event(), threading.Event()
    threads, talks, interrupted = [], [], []

    def slow():
        threads.append(threading.current_thread())
        waiting.set()
        replied.wait(LONG)
        raise TimeoutError("no reply")

    def write(episode):
        if not interrupted:
            interrupted.append(episode.task_id)
            assert waiting.wait(LONG)
            raise KeyboardInterrupt
        return RunDirectory.write(run_directory, episode)

    monkeypatch.setattr(run_directory, "write", write)
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        run_threaded(
            run_directory,
            tasks,
            lambda task, seed: Agent(slow) if task.id == "paper-0" else Agent(),
            concurrency=2,
            keep=lambda episode, agent: talks.append(episode.task_id),
        )
    assert time.monotonic() - started < LONG
    assert no_process()
    done = kept(run_directory)
    assert interrupted[0] in done
    assert "paper-0" not in done
    replied.set()
    threads[0].join(LONG)
    assert not threads[0].is_alive()
    assert (kept(run_directory), "paper-0" in talks) == (done, False)


PARENT = """
import os, socket
from pathlib import Path
from agents import Decision
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.runner import run
from er_gym.tasks.paper_format import read_tasks

folder = Path({folder!r})

class Sleep:
    "In the place of an action: keeps the process busy that it is sent to."
    def __init__(self, file):
        self.file = file
    def __reduce__(self):
        text = f"import pathlib, time; pathlib.Path({{self.file!r}}).touch(); time.sleep(300)"
        return exec, (text,)

class Agent:
    obs_mode = "text"
    def __init__(self, task):
        self.waits = task.id
    def reset(self, task, obs, info):
        pass
    def act(self, obs, info):
        file = folder / f"waiting-{{os.getpid()}}-{{self.waits}}"
        if self.waits == "paper-2":
            here, there = socket.socketpair()
            file.touch()
            here.recv(1)  # as for the reply of a server
        return Decision(Sleep(str(file)) if self.waits == "paper-4" else "end")

if __name__ == "__main__":
    run(
        RunDirectory.open(folder / "run"),
        read_tasks(folder / "tasks.json"),
        lambda task, seed: Agent(task),
        executor="threads",
        parallelism=Parallelism(workers=2, concurrency=2),
    )
"""


def test_a_run_that_is_ended_goes_on_where_it_was(run_directory, tasks, tmp_path):
    """The same command, ended by Ctrl-C and then killed; then what is left of it."""
    stderr = run_until(signal.SIGINT, run_directory, tmp_path)
    assert stderr.count("Traceback") == 1  # the parent's own
    done = kept(run_directory)
    assert done == ["paper-0", "paper-1", "paper-3"]
    assert run_until(signal.SIGKILL, run_directory, tmp_path) == ""
    assert kept(run_directory) == done
    assert run_threaded(run_directory, tasks, ending) == RunSummary(4, 3, ())
    assert kept(run_directory) == ids(tasks)


def run_until(signum: int, run_directory: RunDirectory, folder: Path) -> str:
    """Run the script until an agent waits in it and an engine is stuck, then end it; its stderr."""
    script = folder / "parent.py"
    script.write_text(PARENT.format(folder=str(folder)))
    parent = subprocess.Popen(
        [sys.executable, str(script)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        start_new_session=True,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for(lambda: len(list(folder.glob(f"waiting-{parent.pid}-*"))) == 2)
        if signum == signal.SIGINT:
            os.killpg(parent.pid, signum)  # as a terminal does: to the workers, too
        else:
            parent.send_signal(signum)
        _, stderr = parent.communicate(timeout=LONG)
        wait_for(lambda: living_in(parent.pid) == [])
    finally:
        parent.kill()
    assert parent.returncode == -signum
    return stderr


def living_in(session: int) -> list[int]:
    """The processes of a session that have not ended."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, its_session = stat.read_text().rsplit(")", 1)[1].split()[:4]
        except OSError:
            continue  # it has just ended
        if int(its_session) == session and state != "Z":
            found.append(int(stat.parent.name))
    return found
