"""Runs of er-gym reinforce beside each other: who belongs together, and the table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("torch", reason="needs the extra finetune")
pytest.importorskip("transformers", reason="needs the extra finetune")

from benchmarks.pages.reinforcement import ReinforcedRun, comparison, families_by


def run_at(path: Path, row: str, seed: int, success: float) -> ReinforcedRun:
    path.mkdir()
    told = {
        "settings": {"advantage": {"row": row}, "training": {"seed": seed}},
        "model": "m", "model_digest": "", "suite": "train", "suite_digest": "", "er_gym": "0.1.0",
    }  # fmt: skip
    (path / "reinforce.json").write_text(json.dumps(told))
    lines = [
        {"update": 0, "validation/success": 0.2},
        {"update": 1, "success": 0.0, "episodes": 60, "continued": 40, "seconds": 60.0},
        *(
            {"update": n, "success": success, "episodes": 100 * n, "seconds": 60.0 * n}
            for n in range(2, 12)
        ),
        {"update": 12, "success": success, "episodes": 1200, "seconds": 720.0,
         "validation/success": success},
    ]  # fmt: skip
    (path / "metrics.jsonl").write_text("".join(json.dumps(each) + "\n" for each in lines))
    return ReinforcedRun.load(path)


def test_seeds_of_a_row_are_one_line(tmp_path: Path) -> None:
    runs = [
        run_at(tmp_path / "a", "rloo", 0, 0.5),
        run_at(tmp_path / "b", "gigpo", 0, 0.1),
        run_at(tmp_path / "c", "rloo", 1, 0.7),
    ]
    families = families_by(runs, "advantage.row")
    assert {name: [run.path.name for run in of] for name, of in families.items()} == {
        "rloo": ["a", "c"],
        "gigpo": ["b"],
    }
    table = comparison(families, "advantage.row")
    rloo, gigpo = table.rows
    # The first update is not among the last ten, over which success while it learns is averaged.
    assert rloo == (
        "rloo", "12, 12", "1,200, 1,200", "12, 12", "20.0, 20.0", "50.0, 70.0", "50.0, 70.0",
        "50.0, 70.0",
    )  # fmt: skip
    assert gigpo[4:7] == ("20.0", "10.0", "20.0")
    first, second, *_ = runs[0].curve
    assert (first["episodes"], first["seconds"], first["validation/success"]) == (0, 0.0, 0.2)
    assert second["episodes"] == 100  # with those that were continued


def test_what_is_no_run_or_no_setting(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="is no reinforcement run"):
        ReinforcedRun.load(tmp_path)
    run = run_at(tmp_path / "a", "rloo", 0, 0.5)
    for name in ("advantage.rows", "advantage.row.more", "nothing"):
        with pytest.raises(ValueError, match=f"has no setting {name}"):
            families_by([run], name)
