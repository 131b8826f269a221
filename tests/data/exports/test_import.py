"""What er-gym exports as ShareGPT and imports again is what it was."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.cli.data import data
from er_gym.data.collection import Collection
from er_gym.data.dialects import load_dialect
from er_gym.data.exports import ExportOptions, export
from er_gym.data.sharegpt_files import open_sharegpt
from er_gym.data.sharegpt_import import import_sharegpt


@pytest.mark.parametrize("dialect", ["paper", "tags"])
def test_a_round_trip_keeps_actions_thoughts_pictures_and_flags(
    dialect: str, collection: Collection, tmp_path: Path
) -> None:
    export(collection, "sharegpt", tmp_path / "out", ExportOptions(dialect=dialect))
    before = {each.id: each for each in collection.trajectories()}
    seen = set()
    for name in ("train", "train_turns"):  # in the second, samples repeat what came before
        file = open_sharegpt(tmp_path / "out" / f"{name}.jsonl", decisions=True)
        summary = import_sharegpt(file, tmp_path / name)
        assert not summary.without_scene
        for found in Collection.open(tmp_path / name).trajectories():
            one = before[found.id]
            seen.add(found.id)
            assert (found.instruction, found.language) == (one.instruction, one.language)
            assert found.scene == one.scene.removesuffix("_physics")
            turns = one.turns[: len(found.turns)]
            assert len(turns) == len(one.turns) or not one.turns[len(turns)].train
            for mine, theirs in zip(found.turns, turns, strict=True):
                assert mine.action == theirs.action
                assert [(each.kind, each.text) for each in mine.thoughts] == [
                    (each.kind, each.text) for each in theirs.thoughts
                ]
                assert mine.train == theirs.train
                assert [each.direction for each in mine.pictures] == sorted(
                    (each.direction for each in theirs.pictures),
                    key=["ahead", "right", "behind", "left"].index,
                )
            pictures = {
                (tmp_path / name / each.path).read_bytes()
                for turn in found.turns
                for each in turn.pictures
            }
            assert pictures == {
                (collection.path / each.path).read_bytes()
                for turn in turns
                for each in turn.pictures
            }
            again = load_dialect(dialect).chat(found)
            assert [turn.text for turn in again.turns] == [
                turn.text for turn in load_dialect(dialect).chat(one).turns
            ][: len(again.turns)]
    assert seen == set(before)


def test_the_commands_take_what_was_imported(collection: Collection, tmp_path: Path) -> None:
    export(collection, "ms-swift", tmp_path / "out", ExportOptions(dialect="tags"))
    file = str(tmp_path / "out" / "train.jsonl")
    run = CliRunner()
    result = run.invoke(data, ["import", file, "--out", str(tmp_path / "y")])
    assert result.exit_code == 0, result.output
    assert "trajectories (plain" in result.output
    one = next(Collection.open(tmp_path / "y").trajectories())
    for command in (
        ["stats", str(tmp_path / "y")],
        ["show", str(tmp_path / "y"), "--trajectory", one.id],
        ["export", str(tmp_path / "y"), "--to", "trl", "--out", str(tmp_path / "trl")],
    ):
        result = run.invoke(data, command)
        assert result.exit_code == 0, result.output
    result = run.invoke(data, ["verify", str(tmp_path / "y")])
    assert "cannot be replayed; stats, show and export work on it" in result.output
    result = run.invoke(data, ["import", file, "--out", str(tmp_path / "y")])
    assert "is not empty; choose another output" in result.output
