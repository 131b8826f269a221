"""docs/baselines.md is made from training runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

pytest.importorskip("sb3_contrib", reason="needs the extra rl")
pytest.importorskip("matplotlib", reason="needs the extra charts")

from agents.rl.config import TrainConfig
from agents.rl.train import train
from benchmarks.pages.baselines import main


def test_the_page_says_what_was_played(tmp_path: Path) -> None:
    settings = {
        "total_steps": 64,
        "env": {"episodes": "mini", "types": ["single_pickup", "single_search"]},
        "vec": {"envs": 2, "workers": 1},
        "algorithm": {"name": "ppo", "n_steps": 32, "batch_size": 32},
        "evaluation": {"episodes": "mini", "every": 32, "count": 2},
        "tensorboard": False,
    }
    runs = [tmp_path / "tiny-0", tmp_path / "tiny-1"]
    for seed, run in enumerate(runs):
        train(TrainConfig.model_validate({**settings, "seed": seed}), run)
    out = tmp_path / "docs" / "baselines.md"
    out.parent.mkdir()
    command = [
        *map(str, runs),
        "--work",
        str(tmp_path / "work"),
        "--each",
        "2",
        "--workers",
        "1",
        "--out",
        str(out),
    ]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, result.output
    page = out.read_text()
    assert all(f"| {agent} | " in page for agent in ("tiny", "random", "searcher", "oracle"))
    assert "er-gym train-rl --config tiny --seed 1" in page
    assert "4 tasks in training rooms, 4 in unseen ones" in page
    assert (out.parent / "images" / "learning_steps.png").exists()
    # The second time nothing is played: every result exists.
    episodes = sorted((tmp_path / "work").rglob("*.json"))
    times = [file.stat().st_mtime_ns for file in episodes if file.parent.name == "episodes"]
    assert CliRunner().invoke(main, command).exit_code == 0
    assert times == [f.stat().st_mtime_ns for f in episodes if f.parent.name == "episodes"]
    assert out.read_text() == page


def test_a_directory_without_a_run_is_refused(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, [str(tmp_path)])
    assert isinstance(result.exception, ValueError)
    assert "give run directories of er-gym train-rl" in str(result.exception)
