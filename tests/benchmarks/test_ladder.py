"""The ladder: its phases are commands that exist, and each is run once, whatever happens."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import click
import pytest
import yaml
from click.testing import CliRunner
from forked import start_er_gym

from agents.finetune.settings import load_settings
from benchmarks.cli.main import cli, main
from benchmarks.pages.models import main as models_page
from benchmarks.study.kinds import LADDER, Study
from benchmarks.study.ladder_phases import rungs
from benchmarks.study.phase import Phase
from benchmarks.study.run import PhaseFailed, Plan, PlanRecord, run_plan

for package in ("torch", "transformers", "peft", "tensorboard"):
    pytest.importorskip(package, reason="needs the extra finetune")

SMALL: dict[str, Any] = {
    "base": {"architecture": "tiny-text"},
    "dialect": "text",
    "suite": "mini",
    "workers": 1,
    "pictures": False,
    "play": ["sampling.max_tokens=8"],
    "stages": {
        "imitation": {
            "teacher": {"agent": "searcher", "tasks": 2},
            "finetune": "tiny",
            "set": ["stage=imitation", "training.epochs=1"],
        },
        "exploration": {
            "sample": {"tasks": 1, "samples": 2},
            "finetune": "tiny",
            "again": True,
            "set": ["stage=exploration", "after=imitation", "training.epochs=1"],
        },
        "reflection": {
            "sample": {"tasks": 1, "faults": 0.2},
            "collect": {"parts": ["anomalies"], "limit": 2},
            "finetune": "tiny",
            "set": ["stage=reflection", "after=exploration", "training.epochs=1"],
        },
    },
    "evaluation": {"suite": "mini", "limit": 1, "base": False},
}
"""Every phase is run, but so small a model has no success to learn from: tests/agents/expert/
test_selecting.py tests what successes become."""


def parsed(phase: Phase) -> None:
    """Let click parse a phase's command, as far as it goes without running it."""
    name, *arguments = phase.command
    command = cli.commands[name]
    if isinstance(command, click.Group):
        name, *arguments = arguments
        command = command.commands[name]
    command.make_context(name, [*arguments])


@pytest.mark.parametrize("name", LADDER.names())
def test_the_phases_are_commands_that_exist(name: str, tmp_path: Path) -> None:
    settings = LADDER.load(name)
    plan = Study(LADDER, tmp_path, settings).plan.phases
    names = [phase.name for phase in plan]
    assert len(set(names)) == len(names)
    for phase in plan:
        for name_of, value in pairwise(phase.command):
            if name_of in ("--data", "--correct", "--select"):
                Path(value).mkdir(parents=True, exist_ok=True)
        parsed(phase)
    assert {run for rung in rungs(settings) for run in rung.runs.values()} <= {
        phase.out for phase in plan
    }
    for row in settings.stages.values():
        load_settings(row.finetune, row.set)


def test_each_stage_learns_from_the_model_before(tmp_path: Path) -> None:
    plan = {
        phase.name: phase.command
        for phase in Study(LADDER, tmp_path, LADDER.load("tiny-text")).plan.phases
    }
    first, second, third = (
        plan[f"{stage}/finetune"] for stage in ("1-imitation", "2-exploration", "3-reflection")
    )
    assert option(first, "--model") == [str(tmp_path / "base")]
    assert option(second, "--model") == [str(tmp_path / "1-imitation")]
    assert option(third, "--model") == [str(tmp_path / "2-exploration")]
    sampled = plan["2-exploration/sample"]
    assert option(sampled, "--agent") == [f"hf:{tmp_path / '1-imitation'}"]
    corrected = plan["3-reflection/correct"]
    assert option(corrected, "--correct") == [str(tmp_path / "samples" / "3-reflection")]
    assert option(corrected, "--out")[0] in option(third, "--data")


def test_failures_of_earlier_stages_are_corrected_too(tmp_path: Path) -> None:
    settings = LADDER.load("tiny-text", ["stages.reflection.sample.earlier=true"])
    plan = {phase.name: phase.command for phase in Study(LADDER, tmp_path, settings).plan.phases}
    earlier = plan["3-reflection/correct-2-exploration"]
    assert option(earlier, "--correct") == [str(tmp_path / "samples" / "2-exploration")]
    assert option(earlier, "--out")[0] in option(plan["3-reflection/finetune"], "--data")


def test_the_third_stage_learns_from_faults_and_from_what_is_new_to_the_model(
    tmp_path: Path,
) -> None:
    changed = ["stages.reflection.teacher.faults=0.2", "stages.reflection.sample.own_thoughts=true"]
    settings = LADDER.load("er-tiny-text", changed)
    plan = {phase.name: phase.command for phase in Study(LADDER, tmp_path, settings).plan.phases}
    assert option(plan["3-reflection/teacher"], "--faults") == ["0.2"]
    assert option(plan["3-reflection/sample"], "--faults") == ["0.1"]
    assert "--keep-failed" in plan["3-reflection/taught"]
    assert "--keep-failed" not in plan["2-exploration/taught"]
    learnt = option(plan["2-exploration/teacher"], "--limit")
    assert option(plan["3-reflection/sample"], "--skip") == learnt
    assert option(plan["3-reflection/teacher"], "--skip") == learnt
    assert option(plan["3-reflection/correct"], "--correct-by") == ["searcher"]
    assert "--own-thoughts" in plan["3-reflection/correct"]
    assert "--keep-failed" in plan["3-reflection/select"]
    assert "--rewrite-thoughts" in plan["3-reflection/select"]
    assert option(plan["3-reflection/select"], "--balance") == ["none"]
    data = option(plan["3-reflection/finetune"], "--data")
    for name in ("taught", "correct", "select"):
        assert option(plan[f"3-reflection/{name}"], "--out")[0] in data


def test_eyes_are_taught_before_the_first_stage_and_the_blind_copy_plays_last(
    tmp_path: Path,
) -> None:
    plan = {
        phase.name: phase.command
        for phase in Study(LADDER, tmp_path, LADDER.load("er-tiny-vl")).plan.phases
    }
    frames = str(tmp_path / "data" / "frames")
    made, eyes, first = (
        plan[name] for name in ("base/new-model", "base/eyes", "1-imitation/finetune")
    )
    assert option(plan["base/frames"], "--out") == [frames]
    assert option(made, "--data") == [str(tmp_path / "data" / "1-imitation"), frames]
    assert option(eyes, "--model") == option(made, "--out") == [str(tmp_path / "new-model")]
    assert option(eyes, "--data") == [frames]
    assert option(first, "--model") == option(eyes, "--out") == [str(tmp_path / "base")]
    assert list(plan)[-2:] == ["evaluations/4-random", "evaluations/4-blind"]
    blind, last = plan["evaluations/4-blind"], plan["evaluations/3-reflection"]
    assert option(blind, "--agent") == option(last, "--agent")
    assert "pictures.noise=true" in option(blind, "--set")
    for name in ("base/frames", "1-imitation/collect", "2-exploration/select"):
        assert (option(plan[name], "--width"), option(plan[name], "--height")) == (["448"], ["252"])


def option(command: tuple[str, ...], name: str) -> list[str]:
    return [value for key, value in pairwise(command) if key == name]


BAD = {
    "both": ({"base": {"architecture": "tiny-text", "model": "x"}}, "either model or architecture"),
    "order": (
        {"stages": {"exploration": SMALL["stages"]["exploration"]}},
        "give the first ones of",
    ),
    "nothing": ({"stages": {"imitation": {"finetune": "tiny"}}}, "learns from nothing"),
    "eyes": (
        {"base": {"architecture": "tiny-vl", "eyes": {"frames": 1, "finetune": "tiny"}}},
        "base.eyes needs pictures",
    ),
    "unknown": ({"speed": 3}, "speed"),
    "corrected": (
        {
            "stages": {
                **SMALL["stages"],
                "exploration": {"sample": {"tasks": 1, "earlier": True}, "finetune": "tiny"},
            }
        },
        "exploration corrects nothing; leave out earlier",
    ),
    "rewritten": (
        {
            "stages": {
                **SMALL["stages"],
                "reflection": {
                    "sample": {"tasks": 1, "rewrite_thoughts": True},
                    "finetune": "tiny",
                },
            }
        },
        "leave out rewrite_thoughts",
    ),
    "corrections before the third stage": (
        {
            "stages": {
                **SMALL["stages"],
                "exploration": {
                    "sample": {"tasks": 1, "own_thoughts": True, "successes": True},
                    "finetune": "tiny",
                },
            }
        },
        "exploration corrects nothing; leave out own_thoughts and successes",
    ),
}


@pytest.mark.parametrize(("change", "message"), BAD.values(), ids=BAD)
def test_bad_settings_are_told_in_one_line(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    file = tmp_path / "ladder.yaml"
    file.write_text(yaml.safe_dump({**SMALL, **change}), encoding="utf-8")
    result = CliRunner().invoke(
        cli, ["ladder", "--config", str(file), "--out", str(tmp_path / "x")]
    )
    assert result.exit_code == 2
    assert message in result.output
    assert not (tmp_path / "x").exists()


REFUSED = {
    "architecture": ("base.architecture=nope", "base/new-model: there is no architecture 'nope'"),
    "task type": ("types=[single_serch]", "1-imitation/teacher: unknown task type"),
    "suite": ("evaluation.suite=er-2k", "evaluations/1-imitation: unknown suite 'er-2k'"),
    "part": ("stages.reflection.collect.parts=[x]", "3-reflection/collect: unknown part 'x'"),
    "recipe": (
        "stages.reflection.collect.recipe=x",
        "3-reflection/collect: there is no recipe 'x'",
    ),
    "fine-tuning": ("stages.reflection.finetune=x", "3-reflection/finetune: there is no"),
    "override": ("stages.exploration.set=[stage=x]", "2-exploration/finetune: "),
    "dialect": ("dialect=x", "base/new-model: there is no dialect 'x'"),
    "play": ("play=[sampling.heat=2]", "evaluations/1-imitation: --set sampling.heat=2: the agent"),
    "skipped tasks": (
        "stages.exploration.sample.skip=10000",
        "2-exploration/sample: mini has 132 tasks; skip fewer than 10000",
    ),
    "tasks that a teacher skips": (
        "stages.exploration.teacher={agent: searcher, tasks: 4, skip: 500}",
        "2-exploration/teacher: mini has 132 tasks; skip fewer than 500",
    ),
    "instances": ("instances=all", "1-imitation/teacher: unknown instances 'all'"),
}
"""What only a later phase would refuse, and what is said at once."""


@pytest.mark.parametrize("only_print", [True, False], ids=["print", "run"])
@pytest.mark.parametrize(("change", "message"), REFUSED.values(), ids=REFUSED)
def test_what_a_later_phase_refuses_is_refused_before_the_first(
    change: str, message: str, only_print: bool, tmp_path: Path
) -> None:
    file, out = tmp_path / "ladder.yaml", tmp_path / "x"
    file.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    command = ["ladder", "--config", str(file), "--set", change, "--out", str(out)]
    result = CliRunner().invoke(cli, command + ["--print"] * only_print)
    assert result.exit_code == 2
    assert message in result.output
    assert not out.exists()


EVIL = "open('ran', 'w').close()\nclass Agent: pass\ndef suite(): pass\n"


@pytest.mark.parametrize(
    "changes",
    [
        ("stages.imitation.teacher.agent=evil:Agent",),
        ("suite=evil:suite",),
        ("evaluation.suite=evil:suite",),
        ("stages.imitation.teacher.agent=evil:Agent", "suite=evil:suite", "dialect=text"),
    ],
)
def test_print_imports_nothing_that_a_file_names(
    changes: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "evil.py").write_text(EVIL)
    (tmp_path / "ladder.yaml").write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    command = ["ladder", "--config", "ladder.yaml", "--print"]
    result = CliRunner().invoke(cli, [*command, *(f"--set={each}" for each in changes)])
    assert result.exit_code == 0, result.output
    assert "was not imported, since --print runs nothing" in result.output
    assert not (tmp_path / "ran").exists()
    assert "evil" not in sys.modules
    # What is no such name is refused all the same.
    told = CliRunner().invoke(cli, [*command, "--set", "suite=evil"])
    assert told.exit_code == 2
    assert "unknown suite 'evil'" in told.output


def test_a_plan_can_be_printed_where_it_cannot_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.study.checks.find_spec", lambda library: None)
    command = ["ladder", "--config", "tiny-text", "--out", str(tmp_path / "x")]
    missing = "this phase needs torch, which is not installed: pip install 'er-gym[local]'"
    result = CliRunner().invoke(cli, [*command, "--print"])
    assert result.exit_code == 0, result.output
    assert f"{missing}; this is checked when the plan runs" in result.output
    result = CliRunner().invoke(cli, command)
    assert result.exit_code == 2
    assert f"base/new-model: {missing}" in result.output
    assert not (tmp_path / "x").exists()


def test_a_first_model_must_be_there(tmp_path: Path) -> None:
    file, out = tmp_path / "ladder.yaml", tmp_path / "x"
    model = tmp_path / "model"
    file.write_text(yaml.safe_dump({**SMALL, "base": {"model": str(model)}}), encoding="utf-8")
    command = ["ladder", "--config", str(file), "--out", str(out), "--print"]
    told = CliRunner().invoke(cli, command)
    assert told.exit_code == 2
    assert f"1-imitation/finetune: {model} is not a directory" in told.output
    model.mkdir()
    assert CliRunner().invoke(cli, command).exit_code == 0


def test_a_ladder_is_climbed_though_it_is_killed_twice(tmp_path: Path) -> None:
    file, root = tmp_path / "ladder.yaml", tmp_path / "ladder"
    file.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    command, said = ["ladder", "--config", str(file), "--out", str(root)], tmp_path / "said"
    killed_in = []
    for phase in ("1-imitation", "evaluations/3-reflection"):
        process = start_er_gym(command, said)
        while not (root / phase).exists():
            assert process.exitcode is None, "it ended before it could be killed"
            time.sleep(0.05)
        process.kill()
        process.join()
        killed_in.append(len(done(root)))
    assert killed_in == sorted(set(killed_in))
    process = start_er_gym(command, said)
    process.join()
    assert process.exitcode == 0, said.read_text()
    settings = LADDER.load(str(file))
    assert done(root) == [phase.name for phase in Study(LADDER, root, settings).plan.phases]
    figures = json.loads((root / "result.json").read_text())
    assert [rung["name"] for rung in figures["rungs"]] == [*settings.stages]
    assert figures["rungs"][0]["gain"] is None
    assert figures["rungs"][2]["tokens"] > 0
    table = (root / "result.md").read_text()
    assert "paper: Reasoner" in table
    page = tmp_path / "docs" / "models.md"
    (page.parent / "images").mkdir(parents=True)
    told = CliRunner().invoke(models_page, ["--ladder", str(root), "--out", str(page)])
    assert told.exit_code == 0, told.output
    written = page.read_text(encoding="utf-8")
    assert table in written
    assert all(f"| {name} |" in written for name in done(root))
    assert written.count("](images/") == len([*page.parent.glob("images/*.png")]) >= 2
    before = [each.stat().st_mtime_ns for each in sorted(root.rglob("*.safetensors"))]
    plan = Study(LADDER, root, settings).plan
    run_plan(plan, root, main, lambda *phase: pytest.fail(f"{phase} runs again"))
    assert before == [each.stat().st_mtime_ns for each in sorted(root.rglob("*.safetensors"))]
    other = ["ladder", "--config", str(file), "--set", "seed=3", "--out", str(root)]
    told = CliRunner().invoke(cli, other)
    assert told.exit_code == 2
    assert "holds another ladder: its seed is 0, this one's 3" in told.output


def test_the_time_of_a_phase_is_that_of_all_its_tries(tmp_path: Path) -> None:
    refused = Phase("suites", ("suites", "--nothing"), "suites")
    plan = Plan("ladder", LADDER.load("tiny-text"), (refused,))
    seconds = []
    for _ in range(2):
        with pytest.raises(PhaseFailed):
            run_plan(plan, tmp_path / "x", main, lambda *phase: None)
        record = PlanRecord.model_validate_json((tmp_path / "x" / "ladder.json").read_text())
        seconds.append(record.tried["suites"])
    assert 0 < seconds[0] < seconds[1]
    mended = replace(plan, phases=(Phase("suites", ("--version",), "suites"),))
    (ended,) = run_plan(mended, tmp_path / "x", main, lambda *phase: None).done
    assert ended.seconds > seconds[1]


def done(root: Path) -> list[str]:
    file = root / "ladder.json"
    if not file.exists():
        return []
    return [each.name for each in PlanRecord.model_validate_json(file.read_text()).done]
