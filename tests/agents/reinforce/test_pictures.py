"""Models that see: the learner is shown what the agent saw; and whole runs of such a model."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import accelerate
import pytest
import safetensors.torch
from bandit_runs import bandit_settings, curve
from local_clients import EYES, picture, settings, user
from tiny_qwen import make_tiny_qwen

from agents.finetune.batches import Collator
from agents.finetune.model_files import open_model
from agents.finetune.network import load_network
from agents.finetune.run_files import lines_of
from agents.finetune.settings import ModelSettings
from agents.reinforce import train as training
from agents.reinforce.checks import validation_tasks
from agents.reinforce.episodes import Turn
from agents.reinforce.learner import Learner
from agents.reinforce.rows import Row, rows_of
from agents.reinforce.run_files import EPISODES
from agents.reinforce.settings import ReinforceSettings, load_settings
from agents.reinforce.train import reinforce
from agents.vlm.chat import Message, pictures_of
from agents.vlm.clients.local import LocalClient
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.suites import Suite

SEEING = {
    "curriculum": {"types": ["SingleToggle"]},
    "model": {"freeze": ["vision"]},
    "play": {"group": 3},
    "training": {"updates": 3},
}


def conversation(path: Path) -> list[Turn]:
    """Eight turns with one to three pictures each, all of them different; a token is said in each.

    Where it is no whole letter, the next turn's prompt has another one in its place.
    """
    how = settings(path, sampling={"max_tokens": 1, "temperature": 1.0})
    client = LocalClient(str(path), how, scored=True)
    messages: list[Message] = []
    turns = []
    for number in range(8):
        shown = [picture(60 + 30 * n, 60, 10 * number + n) for n in range(1 + number % 3)]
        messages.append(user("Now?", *shown))
        spoken = client.spoken(messages, 3)
        assert list(spoken.pictures) == pictures_of(messages)
        turns.append(Turn(spoken.prompt, spoken.said, spoken.scores, "", spoken.pictures))
        messages.append(Message("assistant", (spoken.reply.text,)))
    client.close()
    return turns


@pytest.mark.parametrize("family", EYES)
def test_the_learner_is_shown_what_the_agent_saw(family: str, tmp_path: Path) -> None:
    """The chances are those at play; with the pictures of another turn they are not."""
    path = make_tiny_qwen(tmp_path / "model", family=family)
    how = settings(path)
    files = open_model(path)
    (path / "generation_config.json").unlink()  # which has a repetition penalty
    network = load_network(files, ModelSettings(), "float32")
    collator = Collator(
        files.image_processor, files.config.image_token_id, how.pictures.model_bounds, 0, 32
    )
    given = ReinforceSettings.model_validate({"training": {"learning_rate": 1e-12}})
    # Another test in this process may have left its own, with another precision.
    accelerate.state.AcceleratorState._reset_state()
    learner = Learner(network, None, given, accelerate.Accelerator(cpu=True), collator)

    def gap(rows: Sequence[Row]) -> float:
        return learner.learn(rows, 1)["sampler_gap"]

    turns = conversation(path)
    rows = rows_of(turns, [1.0] * 8, "token")
    assert 1 < len(rows) < 8  # some turns go on, some begin anew
    assert gap(rows) < 1e-5
    last = rows[-1]
    turned = replace(last, pictures=(*last.pictures[3:6], *last.pictures[:3], *last.pictures[6:]))
    assert gap([last]) < 1e-5 < 1e-2 < gap([turned])


# -- whole runs ------------------------------------------------------------------------------------


def run_settings(**more: Any) -> ReinforceSettings:
    return bandit_settings(SEEING, more)


def test_a_model_that_sees_learns_and_goes_on_after_an_interruption(
    seeing: Path, suite: Suite, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    reinforce(run_settings(), seeing, suite, whole)
    lines = curve(whole)
    assert [line["update"] for line in lines] == [1, 2, 3]
    assert max(line["sampler_gap"] for line in lines) < 1e-5

    learn, seen = Learner.learn, iter(range(1, 100))

    def interrupted(learner: Learner, rows: Sequence[Row], update: int) -> dict[str, float]:
        assert {(p.width, p.height) for row in rows for p in row.pictures} == {(60, 60)}
        if next(seen) == 3:
            raise KeyboardInterrupt
        return learn(learner, rows, update)

    monkeypatch.setattr(training.Learner, "learn", interrupted)
    with pytest.raises(KeyboardInterrupt):
        reinforce(run_settings(), seeing, suite, cut)
    assert len(curve(cut)) == 2
    reinforce(run_settings(), seeing, suite, cut)
    assert curve(cut) == lines
    episodes = lines_of(whole / EPISODES)
    assert lines_of(cut / EPISODES) == episodes
    assert {each["type"] for each in episodes} == {"single_toggle"}
    mine, theirs = ((each / "model/model.safetensors").read_bytes() for each in (cut, whole))
    assert mine == theirs

    # what is frozen has not changed; what puts its features into words has
    before, after = (
        safetensors.torch.load_file(each / "model.safetensors")
        for each in (seeing, whole / "model")
    )
    changed = {name for name, weight in before.items() if not weight.equal(after[name])}
    assert {name for name in changed if "visual" in name} == {
        name for name in before if "visual.merger" in name
    }
    assert any("visual" not in name for name in changed)
    assert open_model(whole).has_vision


def test_an_adapter_of_a_model_that_sees_learns(seeing: Path, suite: Suite, tmp_path: Path) -> None:
    made = run_settings(
        model={"lora": {"rank": 2}, "freeze": ["vision", "projector"]},
        objective={"kl": 0.1},
        training={"updates": 1, "steps": 2, "checkpointing": True},
    )
    result = reinforce(made, seeing, suite, tmp_path / "run")
    [line] = curve(result.path)
    assert line["kl"] >= 0
    assert line["gradient_norm"] > 0
    adapter = safetensors.torch.load_file(result.path / "model/adapter_model.safetensors")
    assert adapter
    assert not any("visual" in name for name in adapter)


def test_what_a_model_cannot_see_is_said(
    model: Path, seeing: Path, suite: Suite, tmp_path: Path
) -> None:
    blind = shutil.copytree(model, tmp_path / "blind")
    shutil.copyfile(seeing / "agent.yaml", blind / "agent.yaml")
    with pytest.raises(ValueError, match=r"has no vision, and its agent\.yaml shows it pictures"):
        reinforce(run_settings(), blind, suite, tmp_path / "run")
    nowhere = run_settings(curriculum={"types": ["composite"]})
    with pytest.raises(ValueError, match=r"suite two has no task of curriculum\.types"):
        reinforce(nowhere, seeing, suite, tmp_path / "run")
    assert not (tmp_path / "run").exists()
    with pytest.raises(ValueError, match="single_search"):
        run_settings(curriculum={"types": ["searching"]})
    checked = run_settings(curriculum={"types": ["pickup_and_put"]}, validation={"tasks": 9})
    assert {each.type.name for each in validation_tasks(checked)} == {"pickup_and_put"}


def test_each_configuration_can_be_read() -> None:
    names = {file.stem for file in config_directory("reinforce").glob("*.yaml")}
    assert {"tiny", "er-tiny-text", "er-tiny-vl"} <= names
    made = {name: load_settings(name) for name in names}
    taught = read_yaml(config_directory("ladder") / "er-tiny-vl.yaml")["types"]
    assert set(made["er-tiny-vl"].curriculum.types) == set(taught)
