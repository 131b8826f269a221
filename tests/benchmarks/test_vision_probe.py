"""Measuring what a model sees."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.cli.main import cli
from benchmarks.vision_probe import examine as probe
from benchmarks.vision_probe.__main__ import main
from er_gym.data.dialects import load_dialect
from er_gym.data.frame_chat import QUESTIONS, Question, words_for_frames

WORDS = words_for_frames(load_dialect("sight"), "en")
LAPTOP = Question("Laptop", "where Laptop", "Desk ( Laptop far open off ); left")


def test_the_types_that_a_scene_names() -> None:
    text = "<Observation>see CounterTop ( Mug far ), Fridge closed, Flibber\nhold Egg</Observation>"
    assert probe.types_in(text) == {"CounterTop", "Mug", "Fridge", "Egg"}


@pytest.mark.parametrize(
    ("said", "right"),
    [
        (LAPTOP.answer, {"present", "side", "reach", "open", "on", "support"}),
        ("Desk ( Laptop closed off ); left", {"present", "side", "on", "support"}),
        ("Laptop far open on; right", {"present", "reach", "open"}),
        ("Laptop unseen", set()),
    ],
)
def test_answers_are_judged_part_by_part(said: str, right: set[str]) -> None:
    found = probe.verdicts(LAPTOP, said, *WORDS)
    assert {name for name, is_right in found.items() if is_right} == right
    assert found.keys() == ({"present"} if "unseen" in said else
                            {"present", "side", "reach", "open", "on", "support"})  # fmt: skip


def test_precision_recall_and_interval() -> None:
    answers = [
        probe.Answers(frozenset("AB"), frozenset("ABCD")),
        probe.Answers(frozenset("AX"), frozenset("ABCDEF")),
    ]
    precision, recall, f1 = probe.precision_recall_f1(answers)
    assert (precision, recall) == (75.0, 30.0)
    assert f1 == pytest.approx(2 * 75 * 30 / 105)
    moved = probe.misplaced(answers)
    assert [each.there for each in moved] == [answers[1].there, answers[0].there]
    assert [each.named for each in moved] == [each.named for each in answers]
    low, high = probe.f1_interval(answers)
    assert low < f1 < high


def test_a_model_is_measured_from_nothing_to_the_table(tmp_path: Path) -> None:
    for package in ("torch", "transformers", "peft", "tensorboard"):
        pytest.importorskip(package, reason="needs the extra finetune")

    def run(*arguments: str | Path) -> str:
        result = CliRunner().invoke(cli, list(map(str, arguments)))
        assert result.exit_code == 0, result.output
        return result.output

    frames, base, tuned = (tmp_path / each for each in ("frames", "base", "tuned"))
    run("data", "frames", "--suite", "mini", "--scenes", "FloorPlan402", "--frames", "6", "--out",
        frames, "--width", "96", "--height", "54", "--workers", "1")  # fmt: skip
    run("new-model", "tiny-vl", "--set", "vocabulary=400", "--set", "text.num_hidden_layers=1",
        "--data", frames, "--dialect", "sight", "--out", base)  # fmt: skip
    run("finetune", "--config", "tiny", "--model", base, "--data", frames, "--out", tuned,
        "--set", "data.dialect=sight", "--set", "training.epochs=1")  # fmt: skip
    result = CliRunner().invoke(main, [str(tuned), str(frames), "--limit", "3", "--md"])
    assert result.exit_code == 0, result.output
    assert "What is seen in 3 frames" in result.output
    lines = [line.strip("| ").split("|") for line in result.stdout.splitlines() if "|" in line]
    assert [cell.strip() for cell in lines[0]] == ["seeing", "blind"]
    rows = {name.strip(): cells for name, *cells in lines[2:]}
    for name in ("precision", "recall", "F1"):
        assert all(0 <= float(cell) <= 100 for cell in rows[f"types in view, {name}"])
    asked = [int(rows[f"where: {name}"][0].split()[-1]) for name in ("present", "absent")]
    assert 0 < sum(asked) <= 3 * QUESTIONS
