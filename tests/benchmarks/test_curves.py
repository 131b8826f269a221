"""Learning curves are drawn from a run's log."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pytest
from PIL import Image

from benchmarks.scoring.curves import REINFORCED, draw_curves


@dataclass
class Run:
    curve: list[dict[str, float]] = field(default_factory=list)


def rising(to: float, held_out: bool = True) -> Run:
    lines = [
        {"steps": 1000.0 * n, "seconds": 10.0 * n, "rollout/success_rate": to * n / 10}
        for n in range(1, 11)
    ]
    if held_out:
        lines.append({"steps": 10000.0, "seconds": 101.0, "eval/success_rate": to})
        lines.insert(3, {"steps": 4000.0, "seconds": 40.0, "eval/success_rate": to / 3})
    return Run(lines)


def test_a_picture_over_steps_and_one_over_minutes(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra charts")
    families = {"one": [rising(0.9), rising(0.5)], "other": [rising(0.7, held_out=False)], "no": []}
    files = draw_curves(families, tmp_path / "images")
    assert [file.name for file in files] == ["learning_steps.png", "learning_seconds.png"]
    for file in files:
        colors = {color for _, color in Image.open(file).convert("RGB").getcolors(10**6)}
        assert {(0x24, 0x70, 0xAD), (0xB5, 0x76, 0x2A)} <= colors


def test_runs_of_reinforcement_have_axes_of_their_own(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the extra charts")
    run = Run([{"episodes": 100.0 * n, "seconds": 60.0 * n, "success": n / 4} for n in range(4)])
    files = draw_curves({"rloo": [run]}, tmp_path, REINFORCED)
    assert [file.name for file in files] == [
        "reinforcement_episodes.png",
        "reinforcement_seconds.png",
    ]
