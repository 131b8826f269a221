"""From trajectories to a model that plays: every step is a command of er-gym."""

from __future__ import annotations

from pathlib import Path

from click.testing import CliRunner
from small_suite import NAME

from benchmarks.cli.main import cli
from benchmarks.scoring.report import load_run
from benchmarks.scoring.scorers import CORRECTED
from er_gym.data.collection import Collection


def er_gym(*arguments: str | Path) -> None:
    result = CliRunner().invoke(cli, list(map(str, arguments)), standalone_mode=False)
    assert result.return_value in (0, None), result.output
    assert result.exception is None, result.exception


def test_a_tiny_model_with_vision_plays_what_it_has_learnt_by_heart(
    dialect: str, tmp_path: Path
) -> None:
    """Its pictures are the engine's, at learning and at play. It learns actions without thoughts:
    so small a model takes minutes to learn so many sentences."""
    for file in Path(dialect).glob("*.yaml"):
        words = file.read_text().replace("thoughts: tags", "thoughts: none")
        (tmp_path / "actions").mkdir(exist_ok=True)
        (tmp_path / "actions" / file.name).write_text(words)
    dialect = str(tmp_path / "actions")
    data, base, run, played = (tmp_path / each for each in ("data", "base", "run", "played"))
    er_gym("collect", "--suite", NAME, "--parts", "imitation", "--kinds", "b", "--limit", "2",
           "--workers", "1", "--out", data)  # fmt: skip
    er_gym("new-model", "tiny-vl", "--set", "vocabulary=500", "--data", data, "--dialect", dialect,
           "--out", base)  # fmt: skip
    er_gym("finetune", "--config", "tiny", "--model", base, "--data", data, "--out", run,
           "--set", f"data.dialect={dialect}", "--set", "training.epochs=100",
           "--set", "training.batch=2", "--set", "training.learning_rate=0.002")  # fmt: skip
    tasks = ",".join(sorted({each.task_id for each in Collection.open(data).trajectories()}))
    er_gym("bench", "--suite", NAME, "--task-ids", tasks, "--agent", f"hf:{run}",
           "--out", played)  # fmt: skip
    report = load_run(played)
    scores = report.scores[CORRECTED.name]
    assert len(scores) == tasks.count(",") + 1 == 2
    assert [each.task_id for each in scores if not each.success] == []
