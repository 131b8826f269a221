"""A model in this process plays: real pictures, real weights, though random ones."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

from click.testing import CliRunner
from tiny_qwen import make_tiny_qwen

from agents.vlm.record import ConversationRecord
from benchmarks.cli.main import cli
from er_gym.rollout.run_directory import RunDirectory


def test_a_tiny_qwen_plays_with_pictures(tmp_path: Path) -> None:
    make_tiny_qwen(tmp_path / "model", family="qwen2_5_vl")
    out = tmp_path / "run"
    settings = {
        "pictures.width": 300, "pictures.height": 300, "sampling.max_tokens": 8,
        "local.dtype": "float32", "local.device_map": "cpu", "local.batch": 2,
    }  # fmt: skip
    overrides = [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]
    result = CliRunner().invoke(
        cli,
        [
            "bench", "--suite", "mini", "--agent", f"hf:{tmp_path / 'model'}", "--limit", "3",
            "--concurrency", "2", "--out", str(out), *overrides,
        ],
        standalone_mode=False,
    )  # fmt: skip
    assert result.return_value == 0, result.output
    episodes = list(RunDirectory.open(out).episodes())
    assert [each.end_reason for each in episodes] == ["no known action"] * 3
    for file in (out / "conversations").glob("*.json"):
        talk = ConversationRecord.model_validate_json(file.read_bytes())
        words = sum(
            len(part.encode())
            for m in talk.messages[:2]
            for part in m.parts
            if isinstance(part, str)
        )
        shown = [part for m in talk.messages for part in m.parts if not isinstance(part, str)]
        assert [(each.width, each.height) for each in shown] == [(300, 300)]
        # A token a byte, 11 times 11 for the picture, and some around the turns.
        assert 0 < talk.rounds[0].prompt_tokens - words - 121 < 100
        assert [each.completion_tokens for each in talk.rounds] == [8] * 3
