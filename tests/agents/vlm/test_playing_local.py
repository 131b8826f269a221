"""A model in this process plays: real pictures, real weights, though random ones."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

from click.testing import CliRunner
from support import one_torch_thread
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


def test_a_tuned_model_plays_with_the_prompts_that_it_was_tuned_on(tmp_path: Path) -> None:
    make_tiny_qwen(tmp_path / "run" / "model", family="qwen2_5_vl")
    (tmp_path / "run" / "finetune.json").write_text("{}")
    tuned = tmp_path / "run" / "model" / "agent.yaml"
    tuned.write_text("prompts: {dialect: paper, language: en}\npictures: {max_pixels: 50000}\n")
    command = [
        "bench", "--suite", "mini", "--agent", f"hf:{tmp_path / 'run'}", "--limit", "1",
        "--set", "sampling.max_tokens=4", "--set", "local.device_map=cpu", "--out",
        str(tmp_path / "out"),
    ]  # fmt: skip
    with one_torch_thread():
        result = CliRunner().invoke(cli, command, standalone_mode=False)
    assert result.return_value == 0, result.output
    assert f"settings of {tuned}" in result.stderr.replace("\n", "")
    [file] = (tmp_path / "out" / "conversations").glob("*.json")
    talk = ConversationRecord.model_validate_json(file.read_bytes())
    assert talk.prompts == "paper/en"
    pictures = [part for m in talk.messages for part in m.parts if not isinstance(part, str)]
    assert [(each.width, each.height) for each in pictures] == [(280, 140)]
    assert "<|feedback|>" in str(talk.messages[3].parts)
    stated = RunDirectory.open(tmp_path / "out").manifest.agent_settings
    assert stated["pictures"]["max_pixels"] == 50_000
    assert (
        CliRunner()
        .invoke(cli, [*command, "--set", "prompts.dialect=tags"], standalone_mode=False)
        .exception
    )  # another agent's run
