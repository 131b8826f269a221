"""Folders of models are made from training runs, and take nothing that could run code."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra rl")
pytest.importorskip("transformers", reason="needs the extra finetune")

import torch
from safetensors.torch import load_file, save_file
from untrained_policy import write_untrained_run

from agents import packing
from agents.finetune.architecture import load_architecture
from agents.finetune.new_model import make_model
from agents.packing import HISTORY, WEIGHTS, new_folder, pack, same_files
from agents.rl.config import TrainConfig, config_file, load_config
from agents.zoo.index import CARD
from er_gym.writing import YAML_MARK, ForeignFile

SMALL = ("hidden_size=32", "intermediate_size=32", "num_hidden_layers=1")
STAGE = {
    "stage": "imitation", "run": "/scratch/me/runs/one", "data": ["/scratch/me/data/x"],
    "data_digest": "abc", "settings": {}, "conversations": 1200, "updates": 3, "loss": 0.5,
}  # fmt: skip


@pytest.fixture(scope="module")
def policy_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("policy") / "run"
    write_untrained_run(load_config(config_file("single_search"), (), {"seed": 3}), path)
    return path


@pytest.fixture
def language_run(tmp_path: Path) -> Path:
    """A finished fine-tuning run of a tiny model, that has learnt nothing."""
    run = tmp_path / "language"
    changes = [f"text.{each}" for each in SMALL]
    made = load_architecture("tiny-text", ["vocabulary=256", *changes])
    make_model(made, (), run / "model")
    (run / "finetune.json").write_text("{}")
    (run / "model" / "agent.yaml").write_text("sees: text\n")
    told = {"format": "er-gym/finetune-history/1", "runs": [STAGE, {**STAGE, "stage": None}]}
    (run / "model" / HISTORY).write_text(json.dumps(told))
    return run


def test_a_policy_tells_how_it_was_made(policy_run: Path, tmp_path: Path) -> None:
    packed = pack(policy_run, tmp_path, "float16")
    assert packed.kind == "policy"
    assert packed.made_by == ("er-gym train-rl --config single_search --seed 3",)
    assert packed.trained_on.startswith("200,000 steps of MaskablePPO on state, seed 3")
    weights = load_file(tmp_path / "policy.safetensors")
    assert packed.parameters == sum(each.numel() for each in weights.values()) > 10_000


def test_a_policy_of_another_configuration_names_no_command(tmp_path: Path) -> None:
    config = TrainConfig.model_validate({"total_steps": 8, "network": {"width": 8, "kind": 2}})
    write_untrained_run(config, tmp_path / "run")
    (tmp_path / "to").mkdir()
    assert pack(tmp_path / "run", tmp_path / "to", "float16").made_by == ()


def test_a_language_model_is_stored_small_and_played_as_it_was_trained(
    language_run: Path, tmp_path: Path
) -> None:
    from agents.factory import load_settings
    from agents.vlm.clients.checkpoint import load

    folder = tmp_path / "to"
    folder.mkdir()
    packed = pack(language_run, folder, "float16")
    assert packed.kind == "language model"
    assert packed.trained_on == (
        "imitation: 3 updates on 1,200 conversations; then 3 updates on 1,200 conversations"
    )
    whole, half = (load_file(each / WEIGHTS) for each in (language_run / "model", folder))
    assert {each.dtype for each in half.values()} == {torch.float16}
    assert packed.parameters == sum(each.numel() for each in half.values())
    history = (folder / HISTORY).read_text()
    assert (
        json.loads(history)["runs"][0] | {"run": "one", "data": ["x"]}
        == json.loads(history)["runs"][0]
    )
    assert "scratch" not in history
    settings = load_settings(None, ("local.device_map=cpu",), folder / "agent.yaml")
    played = load(str(folder), settings).model.state_dict()
    for name, value in half.items():
        assert played[name].dtype == torch.float32
        assert torch.equal(played[name], value.float())
        torch.testing.assert_close(played[name], whole[name], rtol=1e-3, atol=1e-6)


def without_weights(run: Path) -> None:
    (run / "model" / WEIGHTS).unlink()


def pickled(run: Path) -> None:
    torch.save({}, run / "model" / "pytorch_model.bin")


def too_large_for_half(run: Path) -> None:
    weights = load_file(run / "model" / WEIGHTS)
    save_file({**weights, "more": torch.tensor([1e6])}, run / "model" / WEIGHTS)


def with_a_link(run: Path) -> None:
    (run / "secret.txt").write_text("secret")
    (run / "model" / "notes.txt").symlink_to(run / "secret.txt")


def with_a_linked_folder(run: Path) -> None:
    (run / "model").rename(run / "elsewhere")
    (run / "model").symlink_to("elsewhere")


def with_linked_words(run: Path) -> None:
    (run / "model" / "tokenizer.json").rename(run / "tokenizer.json")
    (run / "model" / "tokenizer.json").symlink_to("../tokenizer.json")


def unfinished(run: Path) -> None:
    (run / "model").rename(run / ".model.draft")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without_weights, "has no model.safetensors"),
        (pickled, "holds pytorch_model.bin, which may run code"),
        (too_large_for_half, "float16 does not hold the weights more; give --dtype bfloat16"),
        (with_a_link, r"notes\.txt is a link to .*secret\.txt, and the zoo takes the files"),
        (with_a_linked_folder, "model is a link to elsewhere, and the zoo takes the files"),
        (with_linked_words, r"tokenizer\.json is a link to \.\./tokenizer\.json"),
        (unfinished, "is not finished"),
    ],
)
def test_a_language_model_that_is_not_taken(
    language_run: Path, tmp_path: Path, change: Callable[[Path], Any], message: str
) -> None:
    change(language_run)
    (tmp_path / "to").mkdir()
    with pytest.raises(ValueError, match=message):
        pack(language_run, tmp_path / "to", "float16")


def test_a_policy_that_is_not_taken(tmp_path: Path) -> None:
    config = load_config(config_file("single_search"))
    write_untrained_run(config, tmp_path / "early", steps=5)
    with pytest.raises(ValueError, match=r"has 5 of 200,000 steps; run er-gym train-rl again"):
        pack(tmp_path / "early", tmp_path, "float16")
    (tmp_path / "elsewhere").mkdir()
    write_untrained_run(config, tmp_path / "elsewhere" / "run")
    (tmp_path / "linked").mkdir()
    for file in (tmp_path / "elsewhere" / "run").iterdir():
        (tmp_path / "linked" / file.name).symlink_to(file)
    with pytest.raises(
        ValueError, match=r"is a link to .*, and the zoo takes the files themselves"
    ):
        pack(tmp_path / "linked", tmp_path, "float16")
    with pytest.raises(ValueError, match="holds no trained model; give a run directory"):
        pack(tmp_path, tmp_path, "float16")


OWN: Mapping[str, Mapping[str, str]] = {
    "a thesis": {"thesis.txt": "mine"},
    "a card of the user's": {"card.yaml": "title: mine"},
    "a note in a model of the zoo": {"card.yaml": f"{YAML_MARK}x: 1", "a.json": "1", "n.md": "m"},
}


@pytest.mark.parametrize("files", OWN.values(), ids=OWN)
def test_what_would_be_lost_is_not_replaced(files: Mapping[str, str], tmp_path: Path) -> None:
    folder = tmp_path / "data"
    folder.mkdir()
    for name, text in files.items():
        (folder / name).write_text(text)
    refused = pytest.raises(ForeignFile, match=r"would be lost|er-gym did not write")
    with refused, new_folder(tmp_path, "data") as draft:
        (draft / "a.json").write_text("2")
        (draft / "card.yaml").write_text(YAML_MARK)
    assert {each.name: each.read_text() for each in folder.iterdir()} == files
    assert [*tmp_path.iterdir()] == [folder]


def test_a_link_is_not_replaced_by_a_folder(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "data").symlink_to("there")
    with pytest.raises(ForeignFile, match="is no folder of its own"), new_folder(tmp_path, "data"):
        pass
    assert (tmp_path / "data").is_symlink()


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    with new_folder(tmp_path, "one") as draft:
        (draft / "a.json").write_text("1")
        (draft / CARD).write_text(YAML_MARK)
    with (
        pytest.raises(FileNotFoundError, match="nowhere"),
        new_folder(tmp_path, "one") as draft,
    ):
        (draft / "nowhere" / "a.json").write_text("2")
    assert (tmp_path / "one" / "a.json").read_text() == "1"
    with new_folder(tmp_path, "one") as draft:
        for name, text in (("a.json", "2"), ("b.json", "2"), (CARD, YAML_MARK)):
            (draft / name).write_text(text)
        assert not same_files(draft, tmp_path / "one")
    names = sorted(each.name for each in tmp_path.rglob("*"))
    assert names == ["a.json", "b.json", CARD, "one"]
    assert (tmp_path / "one" / "a.json").read_text() == "2"


@pytest.mark.parametrize("name", ["model.bin", "weights.pkl", "code.py", "notes", "x.json.gz"])
def test_other_files_are_refused(tmp_path: Path, name: str) -> None:
    with (
        pytest.raises(ValueError, match=f"{name} is no file for the zoo"),
        new_folder(tmp_path, "one") as draft,
    ):
        (draft / name).touch()
    assert not list(tmp_path.iterdir())


def test_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.json").touch()
    with (
        pytest.raises(ValueError, match=r"a\.json is no file for the zoo"),
        new_folder(tmp_path, "one") as draft,
    ):
        (draft / "a.json").symlink_to(tmp_path / "secret.json")


def test_all_models_together_must_stay_small(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packing, "MOST_BYTES", 100)
    for _ in range(2):  # a model takes its own place
        with new_folder(tmp_path, "one") as draft:
            (draft / "a.txt").write_text("x" * 40)
            (draft / CARD).write_text(YAML_MARK)
    with (
        pytest.raises(ValueError, match=r"110 bytes together, and 100 are allowed: one 60, two 50"),
        new_folder(tmp_path, "two") as draft,
    ):
        (draft / "a.txt").write_text("x" * 50)
    assert [each.name for each in tmp_path.iterdir()] == ["one"]
