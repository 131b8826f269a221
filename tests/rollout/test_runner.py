"""Real episodes of the embedded engine, in this process and in spawned ones."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import resource
import signal
from dataclasses import replace

import pytest

from agents import Decision, NamedAgent, make_agent
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout import runner, worker_backend
from er_gym.rollout.events import EpisodeEnded
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import RunSummary
from er_gym.rollout.selection import Shard, select
from er_gym.rollout.worker_pool import LostJob
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.types import task_type


@pytest.fixture
def tasks(tasks_file):
    return read_tasks(tasks_file)


@pytest.fixture
def env():
    made = EmbodiedEnv((), obs_mode="text")
    yield made
    made.close()


@pytest.fixture
def short_env():
    made = EmbodiedEnv((), obs_mode="text", max_steps=8)
    yield made
    made.close()


@pytest.fixture
def new_run_directory(tmp_path, manifest):
    """Makes a run_directory for a run of an agent, in short episodes."""

    def make(agent: str, name: str = "run") -> RunDirectory:
        env = {"obs_mode": "text", "max_steps": 8}
        changed = manifest.model_copy(update={"agent": agent, "env": env, "suite_size": 7})
        return RunDirectory.create(tmp_path / name, changed)

    return make


def run(
    run_directory: RunDirectory, tasks, *, workers=1, on_episode=lambda event: None
) -> RunSummary:
    """Play with the agent that the manifest names; hear of episodes that end."""

    def listen(event):
        if isinstance(event, EpisodeEnded):
            on_episode(event)

    agent = NamedAgent(run_directory.manifest.agent)
    return runner.run(
        run_directory, tasks, agent, parallelism=Parallelism(workers), listeners=[listen]
    )


def modified(run_directory: RunDirectory) -> dict[str, int]:
    return {
        path.name: path.stat().st_mtime_ns for path in (run_directory.path / "episodes").iterdir()
    }


def timeless(episode: EpisodeRecord) -> EpisodeRecord:
    return episode.model_copy(update={"seconds": 0.0})


# -- what is played ------------------------------------------------------------------------------


def test_shards_are_a_partition(tasks):
    ids = [f"task-{number}" for number in range(1000)]
    parts = [[each for each in ids if each in Shard(index, 8)] for index in range(1, 9)]
    assert sorted(itertools.chain(*parts)) == sorted(ids)
    assert all(90 < len(part) < 160 for part in parts)


def test_shards_are_the_same_on_every_machine():
    """Computed with sha256sum."""
    second = [number for number in range(30) if f"paper-{number}" in Shard(2, 8)]
    assert second == [6, 10, 12, 19, 23, 26, 29]


@pytest.mark.parametrize("text", ["2/8", "1/1", "8/8"])
def test_a_shard_is_read(text):
    shard = Shard.parse(text)
    assert f"{shard.index}/{shard.count}" == text


@pytest.mark.parametrize("text", ["0/8", "9/8", "1/0", "2", "2/", "/8", "a/b", "-1/8", "1/2/3"])
def test_what_is_no_shard(text):
    with pytest.raises(ValueError, match="is not a shard: give i/n"):
        Shard.parse(text)


def test_select_keeps_the_suites_order(tasks):
    chosen = select(tasks, task_ids=["paper-5", "paper-2"])
    assert [task.id for task in chosen] == ["paper-2", "paper-5"]


def test_types_are_chosen(tasks):
    other = replace(tasks[0], id="other", type=task_type("single_search"))
    mixed = [*tasks[:3], other]
    assert select(mixed, types=["single_search"]) == [other]
    assert select(mixed, types=["ER-SinglePickup-v0"], limit=2) == tasks[:2]
    with pytest.raises(ValueError, match=r"unknown task type 'single'.*; choose one of"):
        select(mixed, types=["single"])
    with pytest.raises(ValueError, match=r"long-range .*; there are single_pickup, single_search"):
        select(mixed, types=["ER-LongRange-v0"])


def test_the_limit_is_on_what_the_shard_has(tasks):
    shard = Shard(1, 2)
    whole = [task.id for task in tasks if task.id in shard]
    assert [task.id for task in select(tasks, shard=shard, limit=2)] == whole[:2]
    assert select(tasks, limit=100) == tasks
    few, more = (select(tasks, limit=limit, spread=True) for limit in (2, 4))
    assert len(few) == 2
    assert few != tasks[:2]
    assert [task for task in more if task in few] == few
    assert [task for task in tasks if task in more] == more


@pytest.mark.parametrize("spread", [False, True])
def test_what_is_skipped_is_what_the_limit_takes(tasks, spread):
    first = select(tasks, limit=2, spread=spread)
    rest = select(tasks, skip=2, spread=spread)
    assert rest == [task for task in tasks if task not in first]
    assert select(tasks, skip=1, limit=1, spread=spread) == [
        task for task in first if task not in select(tasks, limit=1, spread=spread)
    ]
    with pytest.raises(ValueError, match=f"all {len(tasks)} are skipped; skip fewer than 99"):
        select(tasks, skip=99, spread=spread)


def test_an_unknown_task_is_named(tasks):
    with pytest.raises(ValueError, match=r"'paper-99'; ids here are such as paper-0"):
        select(tasks, task_ids=["paper-1", "paper-99"])


def test_seeds_are_stable_and_differ():
    assert episode_seed(0, "paper-1") == 788330737  # computed with sha256sum
    seeds = {episode_seed(run, f"paper-{n}") for run in range(3) for n in range(100)}
    assert len(seeds) == 300
    assert all(0 <= seed < 2**31 for seed in seeds)


# -- one episode ---------------------------------------------------------------------------------


def test_an_episode_is_written_down(env, tasks):
    record = play_episode(env, make_agent("oracle"), tasks[0], seed=5, agent_name="oracle")
    assert record.error == ""
    assert (record.task_id, record.agent, record.seed) == ("paper-0", "oracle", 5)
    assert record.name == record.instruction == "Take the Apple."
    assert [(key.verb, key.object_type) for key in record.key_actions] == [
        ("navigate to", "CounterTop"),
        ("pickup", "Apple"),
        ("end", ""),
    ]
    verbs = [step.verb for step in record.steps]
    assert (verbs[0], verbs[-2], verbs[-1]) == ("init", "pickup", "end")
    pickup = record.steps[-2]
    assert (pickup.object_type, pickup.object_id) == ("Apple", "Apple|-00.47|+01.15|+00.48")
    assert pickup.text == "pickup Apple"
    assert pickup.success
    assert "CounterTop" in record.steps[0].navigable
    assert record.success
    assert record.end_reason == "end"
    assert record.max_steps == 24
    assert record.total_reward == sum(step.reward for step in record.steps) == 3.0
    assert score_episode(record, CORRECTED).success
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record


class Mumbler:
    """Says what is no action; between that, something that is."""

    obs_mode = "text"

    def __init__(self, *says: str) -> None:
        self.says = list(says)

    def reset(self, task, obs, info):
        pass

    def act(self, obs, info):
        return Decision(self.says.pop(0), thought="well")


def test_replies_that_are_no_action_are_errors(env, tasks):
    agent = Mumbler("dance", "observe", "dance", "sing", "jump")
    record = play_episode(env, agent, tasks[0], seed=0)
    assert [step.verb for step in record.steps] == ["init", "error", "observe", *["error"] * 3]
    assert [step.text for step in record.steps][1:] == ["dance", "observe", "dance", "sing", "jump"]
    assert record.num_steps == 2
    assert record.end_reason == "no known action"
    assert record.agent == "Mumbler"
    assert record.steps[1].thought == "well"
    assert not record.steps[1].success


def test_a_crash_is_written_down_with_what_was_before(env, tasks):
    record = play_episode(env, Mumbler("observe"), tasks[0], seed=0)
    assert [step.verb for step in record.steps] == ["init", "observe"]
    assert record.error.startswith("IndexError: pop from empty list (")
    assert "test_runner.py:" in record.error
    assert (record.success, record.end_reason) == (False, "")


# -- a run ---------------------------------------------------------------------------------------


def test_workers_play_what_is_played_here(new_run_directory, tasks, short_env):
    """The random agent, because it would show if anything but the task's seed mattered."""
    here = []
    for task in tasks:
        seed = episode_seed(0, task.id)
        agent = make_agent("random", seed=seed)
        played = play_episode(short_env, agent, task, seed, agent_name="random")
        here.append(timeless(played))
    assert len({tuple(step.text for step in each.steps) for each in here}) == 7

    seen = []
    one, two = new_run_directory("random", "one"), new_run_directory("random", "two")
    assert run(one, tasks, workers=1, on_episode=seen.append) == RunSummary(7, 0, ())
    assert run(two, tasks[::-1], workers=2) == RunSummary(7, 0, ())
    assert [timeless(each) for each in one.episodes()] == here
    assert [timeless(each) for each in two.episodes()] == here
    assert sorted(each.task_id for each in seen) == [task.id for task in tasks]


def test_running_again_plays_nothing_again(new_run_directory, tasks):
    run_directory = new_run_directory("oracle")
    run(run_directory, tasks[:4], workers=2)
    before = modified(run_directory)
    assert len(before) == 4
    assert run(run_directory, tasks, workers=2) == RunSummary(3, 4, ())
    after = modified(run_directory)
    assert len(after) == 7
    assert {name: after[name] for name in before} == before
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert run(run_directory, tasks, workers=2) == RunSummary(0, 7, ())
    assert resource.getrusage(resource.RUSAGE_CHILDREN) == children  # no process was started
    assert modified(run_directory) == after


def test_a_crashed_episode_is_played_again(new_run_directory, tasks, episode):
    run_directory = new_run_directory("oracle")
    run(run_directory, tasks, workers=1)
    (first, *_) = run_directory.episodes()
    run_directory.write(first.model_copy(update={"error": "ValueError: no"}))
    before = modified(run_directory)
    assert run(run_directory, tasks, workers=1) == RunSummary(1, 6, ())
    assert not any(each.error for each in run_directory.episodes())
    changed = {name for name, when in modified(run_directory).items() if when != before[name]}
    assert changed == {"paper-0.json"}


def test_killed_workers_are_replaced(new_run_directory, tasks):
    run_directory = new_run_directory("random")
    victims = []

    def kill_all_once(episode):
        if not victims:
            for child in multiprocessing.active_children():
                victims.append(child.pid)
                os.kill(child.pid, signal.SIGKILL)

    assert run(run_directory, tasks, workers=2, on_episode=kill_all_once) == RunSummary(7, 0, ())
    assert len(victims) == 2
    assert len(modified(run_directory)) == 7


def test_a_task_that_kills_its_worker_is_reported(new_run_directory, tasks, monkeypatch):
    run_directory = new_run_directory("oracle")

    def give_up(make, jobs, **how):
        for job in jobs:
            yield job, LostJob(tries=3, exitcode=-9)

    monkeypatch.setattr(worker_backend, "run_jobs", give_up)
    outcome = run(run_directory, tasks[:1])
    (record,) = outcome.crashed
    assert record.error == "the worker process died 3 times, last with exit code -9"
    assert list(run_directory.episodes()) == [record]
    monkeypatch.undo()
    assert run(run_directory, tasks[:1]) == RunSummary(1, 0, ())


def test_crashes_do_not_end_a_run(new_run_directory, tasks):
    bad = replace(tasks[1], scene="FloorPlan999")
    outcome = run(new_run_directory("oracle"), [tasks[0], bad, tasks[2]], workers=1)
    assert outcome.played == 3
    (crashed,) = outcome.crashed
    assert crashed.task_id == "paper-1"
    assert "FloorPlan999" in crashed.error


def test_ctrl_c_keeps_what_is_done(new_run_directory, tasks):
    run_directory = new_run_directory("random")

    def interrupt(episode):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(run_directory, tasks, workers=2, on_episode=interrupt)
    assert multiprocessing.active_children() == []
    assert len(modified(run_directory)) == 1
    assert run(run_directory, tasks, workers=2) == RunSummary(6, 1, ())
