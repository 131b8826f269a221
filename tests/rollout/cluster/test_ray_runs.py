"""Whole commands on a cluster of three nodes, some of whose processes are killed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.util import find_spec

import pytest
from support import ROOT

if find_spec("ray") is None:
    pytest.skip("Ray is not installed", allow_module_level=True)

from benchmarks.checks.cluster_kills import episodes_of, play_and_kill
from benchmarks.checks.ray_nodes import ray_nodes


@pytest.fixture(scope="module")
def nodes():
    with ray_nodes(3) as made:
        yield made


def er_gym(*arguments, cwd=ROOT, nodes=None, code=0):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    on_ray = () if nodes is None else ("--executor", "ray", "--ray-address", nodes.address)
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.cli", *map(str, arguments), *on_ray],
        cwd=cwd,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == code, done.stderr
    return done


def test_the_doctor_looks_at_every_node(nodes, tmp_path):
    told = er_gym("doctor", "--ray", "--ray-address", nodes.address, "--shared-dir", tmp_path)
    lines = told.stdout.splitlines()
    assert [line.split()[:2] for line in lines][:2] == [["ok", "ray"], ["ok", "cluster"]]
    assert sum("a picture after" in line for line in lines) == len(lines) - 2 >= 2
    assert list(tmp_path.iterdir()) == []


def test_a_run_begun_here_and_finished_there_while_processes_die(nodes, tmp_path):
    play = ["bench", "--suite", "er-1k", "--agent", "searcher", "--limit"]
    here, there = tmp_path / "here", tmp_path / "there"
    er_gym(*play, "60", "--out", here)
    er_gym(*play, "5", "--out", there)
    killed = play_and_kill([*play, "60"], there, nodes, kills=2, every=10, seed=9)
    assert killed == {"workers": 1, "nodes": 1}
    assert episodes_of(there) == episodes_of(here)
    assert len(episodes_of(there)) == 60
    events = [json.loads(line) for line in (there / "events.jsonl").read_bytes().splitlines()]
    ended = [each["task_id"] for each in events if each["kind"] == "episode_ended"]
    assert len(ended) == len(set(ended)) == 60
    assert sum(each["kind"] == "step" for each in events) > 60


def test_an_agent_of_the_users_own_travels(nodes, tmp_path):
    (tmp_path / "mine.py").write_text(
        "from er_gym.rollout.agent import Decision\n"
        "class Mine:\n"
        "    obs_mode = 'text'\n"
        "    attachment_folders = ('notes',)\n"
        "    def reset(self, task, obs, info): pass\n"
        "    def act(self, obs, info): return Decision('end', thought='mine')\n"
        "    def attachments(self, episode, stem): return {f'notes/{stem}.txt': b'well'}\n"
    )
    for options in ((), ("--shared-dir",)):  # files travel, or are written where they are made
        run = tmp_path / f"run{len(options)}"
        play = ("bench", "--suite", "er-1k", "--agent", "mine:Mine", "--limit", "2", "--out", run)
        er_gym(*play, *options, cwd=tmp_path, nodes=nodes)
        episodes = episodes_of(run).values()
        assert [each["steps"][1]["thought"] for each in episodes] == ["mine", "mine"]
        assert [each.read_bytes() for each in (run / "notes").iterdir()] == [b"well"] * 2


def test_a_collection_is_the_same_and_is_verified_where_its_files_are(nodes, tmp_path):
    collect = ("collect", "--suite", "mini", "--recipe", "balanced", "--parts", "imitation")
    collect += ("--types", "single_pickup", "--limit", "2", "--width", "64", "--height", "64")
    er_gym(*collect, "--out", tmp_path / "here")
    er_gym(*collect, "--out", tmp_path / "there", nodes=nodes)
    files = ["trajectories.jsonl", "collection.json"]
    files += [str(each.relative_to(tmp_path / "here")) for each in tmp_path.glob("here/**/*.jpeg")]
    assert len(files) > 6
    for name in files:
        assert (tmp_path / "there" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()
    verify = ("data", "verify", tmp_path / "there")
    refused = er_gym(*verify, nodes=nodes, code=2)
    assert "put it where all nodes see it and give --shared-dir" in refused.stderr
    assert "2 of 2 trajectories" in er_gym(*verify, "--shared-dir", nodes=nodes).stdout


def test_tasks_are_generated_the_same(nodes, tmp_path):
    generate = ("tasks", "generate", "--total", "6", "--scenes", "FloorPlan1,FloorPlan201")
    generate += ("--types", "single_search", "--layouts", "1")
    for name, where in (("here", None), ("there", nodes)):
        er_gym(*generate, "--out", tmp_path / name / "some.jsonl", nodes=where)
    made = [(tmp_path / name / "some.jsonl").read_bytes() for name in ("here", "there")]
    assert made[0] == made[1]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--shared-dir",), "--shared-dir is for --executor ray"),
        (("--executor", "ray", "--shared-dir"), "--shared-dir is for --ray-address"),
        (("--worker-cpus", "2"), "--worker-cpus is for --executor ray"),
        (("--executor", "ray", "--ray-address", "127.0.0.1:1"), "no Ray cluster answers at"),
    ],
)
def test_options_that_do_not_go_together_change_nothing(options, told, tmp_path):
    play = ("bench", "--suite", "mini", "--agent", "oracle", "--out", tmp_path / "run")
    assert told in er_gym(*play, *options, code=2).stderr
    assert not (tmp_path / "run").exists()
