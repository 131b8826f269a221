"""``er-gym data export`` as a user gives it."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest
from click.testing import CliRunner

from benchmarks.cli.data_export import export as command
from benchmarks.cli.options import LANGUAGES
from er_gym.data.collection import Collection
from er_gym.data.exports import EXPORTS
from er_gym.data.trajectory import Language


def test_a_collection_becomes_training_files(collection: Collection, tmp_path: Path) -> None:
    out = tmp_path / "out"
    given = [str(collection.path), "--to", "ms-swift", "--out", str(out), "--held-out", "0.25"]
    result = CliRunner().invoke(command, [*given, "--dialect", "paper", "--language", "zh"])
    assert result.exit_code == 0, result.output
    assert f"{out}: ms-swift, samples: train 9, validation 3" in result.output
    assert "任务" in (out / "train.jsonl").read_text(encoding="utf-8")
    assert (out / "README.md").is_file()
    again = CliRunner().invoke(command, given)
    assert again.exit_code == 2
    assert "is not empty; choose another output" in again.output


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--to", "csv"], "unknown export format 'csv'"),
        (["--to", "shargpt"], "did you mean sharegpt"),
        (["--to", "trl", "--dialect", "pirate"], "choose one of: paper, sight, tags"),
        (["--to", "trl", "--language", "fr"], "'en', 'zh'"),
        (["--to", "trl", "--held-out", "Attic"], "no room 'Attic'"),
        (["--to", "trl", "--held-out", "2"], "give 0 to less than 1"),
        (["--to", "trl", "--per-turn"], "--per-turn does not go with --to trl"),
        (["--to", "minari", "--tasks-file", "nowhere"], "nowhere"),
    ],
)
def test_bad_input_is_one_line(
    collection: Collection, tmp_path: Path, arguments: list[str], problem: str
) -> None:
    out = tmp_path / "out"
    result = CliRunner().invoke(command, [str(collection.path), *arguments, "--out", str(out)])
    assert result.exit_code == 2
    assert problem in result.output.splitlines()[-1]
    assert not out.exists()


def test_no_collection_is_said(tmp_path: Path) -> None:
    given = [str(tmp_path), "--to", "trl", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(command, given)
    assert result.exit_code == 2
    assert "is no collection: " in result.output


def test_help_names_what_there_is() -> None:
    text = " ".join(CliRunner().invoke(command, ["--help"]).output.split())
    assert all(name in text for name in EXPORTS.own)
    assert get_args(Language) == LANGUAGES
