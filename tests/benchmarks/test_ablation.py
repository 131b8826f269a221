"""Ablations: their phases are commands that exist, and their tables compare what was measured."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml
from click.testing import CliRunner
from forked import start_er_gym

from agents.finetune.samples import drawn
from agents.finetune.settings import load_settings
from benchmarks.cli.main import cli
from benchmarks.pages.models import main as models_page
from benchmarks.study.kinds import ABLATION, Study

for package in ("torch", "transformers", "peft", "tensorboard"):
    pytest.importorskip(package, reason="needs the extra finetune")

STEP = {"data": ["expert"], "set": ["training.epochs=1"]}
SMALL: dict[str, Any] = {
    "architecture": "tiny-text",
    "words": "expert",
    "dialect": "text",
    "suite": "mini",
    "workers": 1,
    "pictures": False,
    "play": ["sampling.max_tokens=8"],
    "finetune": "tiny",
    "collections": {"expert": {"collect": {"parts": ["imitation"], "limit": 2}}},
    "rows": {
        "once": {"steps": [STEP]},
        "actions": {"steps": [STEP, STEP], "dialect": "text-actions"},
    },
    "studies": {
        "both": {"title": "Both", "rows": ["once", "actions"], "axis": "x", "numbers": [1, 2]}
    },
    "evaluation": {"suite": "mini", "limit": 1},
}


@pytest.mark.parametrize("name", ABLATION.names())
def test_the_phases_are_commands_that_exist(name: str, tmp_path: Path) -> None:
    settings = ABLATION.load(name)
    plan = Study(ABLATION, tmp_path, settings).plan.phases
    assert len({phase.name for phase in plan}) == len(plan)
    for phase in plan:
        for option, value in pairwise(phase.command):
            if option in ("--data", "--select"):
                Path(value).mkdir(parents=True, exist_ok=True)
        command, *arguments = phase.command
        cli.commands[command].make_context(command, arguments)
    for row in settings.rows.values():
        for step in row.steps:
            load_settings(settings.finetune, (*settings.set, *step.set))


def test_a_small_ablation_is_run_and_told(tmp_path: Path) -> None:
    file, root = tmp_path / "small.yaml", tmp_path / "out"
    file.write_text(yaml.safe_dump(SMALL), encoding="utf-8")
    said = tmp_path / "said"
    process = start_er_gym(["ablate", "--config", str(file), "--out", str(root)], said)
    process.join()
    assert process.exitcode == 0, said.read_text()
    first, second = json.loads((root / "result.json").read_text())["studies"]["both"]
    assert (first["name"], first["n"], first["difference"]) == ("once", 1, None)
    assert second["difference"]["mean"] == second["success"]["mean"] - first["success"]["mean"]
    assert "| actions |" in (root / "result.md").read_text()
    assert (root / "both.png").stat().st_size > 0
    page = tmp_path / "docs" / "models.md"
    (page.parent / "images").mkdir(parents=True)
    told = CliRunner().invoke(models_page, ["--ablation", str(root), "--out", str(page)])
    assert told.exit_code == 0, told.output
    assert (root / "result.md").read_text() in page.read_text()
    # The second step tunes what the first one made.
    run = json.loads((root / "models" / "actions" / "0" / "2" / "finetune.json").read_text())
    assert str(root / "models" / "actions" / "0" / "1") in json.dumps(run)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"words": "others"}, "there is no collection 'others'; there are: expert"),
        (
            {"studies": {"both": {"title": "Both", "rows": ["once", "twice"]}}},
            "there is no row 'twice'",
        ),
        ({"collections": {"expert": {}}}, "give either collect or teacher"),
    ],
)
def test_bad_settings_are_told_in_one_line(
    change: dict[str, Any], message: str, tmp_path: Path
) -> None:
    file = tmp_path / "small.yaml"
    file.write_text(yaml.safe_dump({**SMALL, **change}), encoding="utf-8")
    result = CliRunner().invoke(cli, ["ablate", "--config", str(file), "--print"])
    assert result.exit_code == 2
    assert message in result.output


def test_a_draw_is_spread_and_a_smaller_one_is_part_of_it() -> None:
    few, more = list(drawn(range(1000), 20)), list(drawn(range(1000), 200))
    assert set(few) < set(more)
    assert few == sorted(few)
    assert few[0] < 200 < 800 < few[-1]
    assert list(drawn(iter(range(3)), None)) == [0, 1, 2] == list(drawn(range(3), 9))
