"""Pages of training: a policy, a fine-tuning, a ladder and an ablation, while they grow."""

from __future__ import annotations

import html
import json
import os
import re
import shutil
import socket
from pathlib import Path

from fastapi.testclient import TestClient
from filelock import lock_descriptor
from training_runs import make_finetuning, make_policy, metric

from benchmarks.monitor.directories import Directories
from benchmarks.monitor.fingerprint import fingerprint, in_use
from benchmarks.study.kinds import ABLATION, LADDER, Study
from benchmarks.study.run import DonePhase, Plan, PlanRecord
from er_gym import __version__
from er_gym.locking import LOCK, exclusive_use


def said(text: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", text.replace("<wbr>", ""))).split())


def make_plan(plan: Plan, folder: Path, done: int) -> None:
    """The record that a plan leaves after some of its phases."""
    phases = [
        DonePhase(name=phase.name, command=list(phase.command), seconds=61.0)
        for phase in plan.phases[:done]
    ]
    record = PlanRecord(
        format=plan.format,
        settings=plan.settings.model_dump(mode="json"),
        er_gym=__version__,
        done=phases,
    )
    (folder / plan.file).write_text(record.model_dump_json())


def page(client: TestClient, root: Path, name: str) -> str:
    (id,) = (each.id for each in Directories([root]).all() if each.path == root / name)
    answer = client.get(f"/training/{id}")
    assert answer.status_code == 200
    return answer.text


def test_a_fine_tuning_grows_while_it_is_looked_at(tmp_path, visit):
    folder = make_finetuning(tmp_path / "tuning")
    client = visit(tmp_path)
    first = page(client, tmp_path, "tuning")
    assert "100 / 400" in said(first)  # one of four epochs
    assert len(re.findall(r'<svg class="chart"', first)) == 4
    (directory,) = Directories([tmp_path]).all()
    before = fingerprint(directory)
    with (folder / "metrics.jsonl").open("a") as log:
        log.write(metric(200, 0.25))
    assert fingerprint(directory) != before
    second = page(client, tmp_path, "tuning")
    assert "200 / 400" in said(second)
    assert "0.25" in said(second)
    assert "running" in said(second)
    (folder / "model").mkdir()
    assert "finished" in said(page(client, tmp_path, "tuning"))


def test_a_policy_shows_training_and_evaluation(tmp_path, visit):
    make_policy(tmp_path / "policy")
    text = page(visit(tmp_path), tmp_path, "policy")
    assert "2,000 / 4,000" in said(text)
    assert "Success, evaluation 50.0 %" in said(text)
    assert "Success, while it trains 25.0 %" in said(text)
    assert "while it trains: 1, 25" in text  # the chart's description
    assert "evaluation: 1, 50" in text
    assert "single_search 25.0 %" in said(text)


def test_curves_of_several_runs_are_laid_over_one_another(tmp_path, visit):
    folders = [make_policy(tmp_path / name) for name in ("one", "two", "other")]
    for seed, folder in enumerate(folders):
        config = (folder / "config.yaml").read_text()
        other = config.replace("4000", "9000") if folder.name == "other" else config
        (folder / "config.yaml").write_text(f"seed: {seed}\n{other}")
    client = visit(tmp_path)
    ids = {each.path.name: each.id for each in Directories([tmp_path]).all()}
    listed = client.get("/training").text
    assert all(f'name="of" value="{id}"' in listed for id in ids.values())
    asked = "&".join(f"of={ids[name]}" for name in ("one", "two", "other")) + "&of=000000000000"
    page = client.get(f"/training/curves?{asked}").text
    assert "/static/uPlot.iife.min.js" in page
    address = re.search(r'data-points="([^"]+)"', page)[1].replace("&amp;", "&")
    told = client.get(address).json()["runs"]
    assert [run["id"] for run in told] == [ids[name] for name in ("one", "two", "other")]
    assert told[0]["series"]["rollout/success_rate"] == [[1000.0], [0.25]]
    assert "steps" not in told[0]["series"]
    assert told[0]["group"] == told[1]["group"] != told[2]["group"]
    assert client.get("/training/curves").status_code == 200
    assert client.get("/static/uPlot.iife.min.js").text.startswith(
        "/*! https://github.com/leeoniya"
    )


def test_a_reinforcement_shows_success_and_each_reward(tmp_path, visit):
    folder = tmp_path / "learning"
    folder.mkdir()
    told = {"model": "m", "suite": "train",
            "settings": {"training": {"updates": 8}, "advantage": {"row": "gigpo"}}}  # fmt: skip
    (folder / "reinforce.json").write_text(json.dumps(told))
    lines = [
        {"update": 0, "validation/success": 0.5},
        {"update": 1, "success": 0.25, "reward": 0.2, "reward/success": 0.25,
         "reward/repeated": -0.05, "success/single_search": 0.75},
    ]  # fmt: skip
    (folder / "metrics.jsonl").write_text("".join(json.dumps(each) + "\n" for each in lines))
    client = visit(tmp_path)
    text = page(client, tmp_path, "learning")
    assert "1 / 8" in said(text)
    assert "Success, while it trains 25.0 %" in said(text)
    assert "Success, evaluation 50.0 %" in said(text)
    assert "repeated: 1, -0.05" in text  # the chart's description
    assert "single_search 75.0 %" in said(text)
    assert "learning Reinforcement gigpo" in said(client.get("/training").text)
    (folder / "model").mkdir()
    assert "finished" in said(page(client, tmp_path, "learning"))


def test_a_ladder_shows_its_phases_and_the_success_of_each_rung(tmp_path, visit, runs):
    root = tmp_path / "ladder"
    root.mkdir()
    settings = LADDER.load("tiny-text")
    plan = Study(LADDER, root, settings).plan
    names = [phase.name for phase in plan.phases]
    measured = names.index("evaluations/1-imitation")
    shutil.copytree(runs / "random", root / "evaluations" / "0-base")
    shutil.copytree(runs / "oracle", root / "evaluations" / "1-imitation")
    make_finetuning(root / "1-imitation")
    make_plan(plan, root, measured)
    with exclusive_use(root):
        text = page(visit(tmp_path), tmp_path, "ladder")
    assert f"{measured} / {len(names)}" in said(text)
    states = re.findall(r'<span class="state (\w+)">', text[text.index('id="phases"') :])
    assert states == ["finished"] * measured + ["running"] + ["waiting"] * (
        len(names) - measured - 1
    )
    ids = {each.path: each.id for each in Directories([tmp_path]).all()}
    for name, kind in (("evaluations/0-base", "runs"), ("1-imitation", "training")):
        assert f'href="/{kind}/{ids[root / name]}"' in text
    results = text[text.index('id="results"') : text.index('id="phases"')]
    assert "imitation 0 % 8 100.0 % 67.6 to 100.0 %" in said(results)
    assert "this ladder: 2, 0 … 100" in text
    assert "the paper&#39;s models" in text
    listed = said(visit(tmp_path).get("/training").text)
    assert f"{measured} of {len(names)} phases" in listed
    assert "ladder/1-imitation Fine-tuning imitation" in listed


def test_an_ablation_shows_its_studies(tmp_path, visit, runs):
    root = tmp_path / "ablation"
    root.mkdir()
    settings = ABLATION.load(ABLATION.names()[0])
    make_plan(Study(ABLATION, root, settings).plan, root, 1)
    study = next(iter(settings.studies.values()))
    for name, run in zip(study.rows, ("oracle", "random"), strict=False):
        shutil.copytree(runs / run, root / "evaluations" / name / str(settings.seeds[0]))
    text = page(visit(tmp_path), tmp_path, "ablation")
    assert study.title in html.unescape(text)
    assert f"{study.rows[0]} 8 100.0 %" in said(text)
    assert '<svg class="chart"' in text


def test_damaged_settings_are_told_in_a_line(tmp_path, visit):
    root = tmp_path / "ladder"
    root.mkdir()
    done = [{"name": "<b>1</b>", "command": ["collect"], "seconds": 1.0}]
    (root / "ladder.json").write_text(
        json.dumps({"format": "er-gym/ladder/1", "settings": {}, "er_gym": "0", "done": done})
    )
    make_finetuning(tmp_path / "tuning")
    (tmp_path / "tuning" / "finetune.json").write_text("{")
    client = visit(tmp_path)
    text = page(client, tmp_path, "ladder")
    assert 'class="problem">ladder.json: base' in text
    assert "&lt;b&gt;1&lt;/b&gt;" in text
    assert 'class="problem"' in page(client, tmp_path, "tuning")
    assert client.get("/training").status_code == 200
    assert client.get("/training/000000000000").status_code == 404


def test_who_holds_the_lock_is_seen_without_touching_it(tmp_path):
    assert not in_use(tmp_path)
    with exclusive_use(tmp_path):
        assert in_use(tmp_path)
        with (tmp_path / LOCK).open() as file:
            assert not lock_descriptor(file.fileno(), blocking=False)  # it is still held
    ended = os.fork()
    if not ended:
        os._exit(0)
    os.waitpid(ended, 0)
    (tmp_path / LOCK).write_text(f"{ended} {socket.gethostname()}\n")
    assert not in_use(tmp_path)
