"""A new model appears whole, and the same command given again changes nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

from agents.finetune.architecture import load_architecture
from agents.finetune.new_model import make_model

SMALL = load_architecture(
    "tiny-text", ["vocabulary=300", "text.hidden_size=32", "text.num_hidden_layers=1"]
)
TEXTS = ("navigate to Fridge", "open Fridge", "pickup Egg", "put in Fridge") * 50


def times(folder: Path) -> dict[str, int]:
    return {file.name: file.stat().st_mtime_ns for file in folder.iterdir()}


def test_the_same_again_changes_nothing_and_another_is_refused(tmp_path: Path) -> None:
    """A ladder that is killed before it has noted this phase gives the command again."""
    made = make_model(SMALL, TEXTS, tmp_path / "model", seed=3)
    before = times(made)
    assert "model.safetensors" in before
    assert make_model(SMALL, TEXTS, made, seed=3) == made
    with pytest.raises(ValueError, match="exists and does not hold this model"):
        make_model(SMALL, TEXTS, made, seed=4)
    with pytest.raises(ValueError, match="exists and does not hold this model"):
        make_model(SMALL, TEXTS[:1], made, seed=3)
    assert times(made) == before
    assert [each.name for each in tmp_path.iterdir()] == ["model"]


def test_a_folder_with_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match="exists and does not hold this model"):
        make_model(SMALL, TEXTS, tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["notes.txt"]
