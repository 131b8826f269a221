"""Models are found by name, and stand for the agents that play them."""

from __future__ import annotations

from pathlib import Path

import pytest

from agents import make_agent
from agents.factory import is_model_agent, settings_file
from agents.zoo import index
from agents.zoo.card import Card, card_text
from agents.zoo.index import CARD, find_model, model_names, resolved

FIELDS = {
    "title": "Plays", "parameters": 3, "dtype": "float16", "bytes": 9, "trained_on": "nothing",
    "er_gym": "0.1.0", "made_by": ["er-gym train-rl --config exposed"],
}  # fmt: skip


@pytest.fixture(autouse=True)
def models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A zoo with a policy ``walker`` and a language model ``talker``."""
    monkeypatch.setattr(index, "FOLDER", tmp_path)
    for name, kind in (("walker", "policy"), ("talker", "language model")):
        (tmp_path / name).mkdir()
        card = Card.model_validate({**FIELDS, "kind": kind})
        (tmp_path / name / CARD).write_text(card_text(card))
    (tmp_path / ".draft-of-a-kill").mkdir()
    (tmp_path / ".draft-of-a-kill" / CARD).touch()
    (tmp_path / "talker" / "agent.yaml").write_text("sees: text\n")
    return tmp_path


def test_a_name_stands_for_the_agent_of_its_kind(models: Path) -> None:
    assert model_names() == ("talker", "walker")
    assert resolved("zoo:walker") == f"rl:{models / 'walker'}"
    assert resolved("zoo:talker") == f"hf:{models / 'talker'}"
    assert resolved("oracle") == "oracle"
    assert find_model("walker").card.title == "Plays"


def test_a_language_model_is_an_agent_with_its_own_settings(models: Path) -> None:
    assert is_model_agent("zoo:talker")
    assert settings_file("zoo:talker") == models / "talker" / "agent.yaml"
    assert not is_model_agent("zoo:walker")


@pytest.mark.parametrize("name", ["wolker", "", "../walker", "WALKER"])
def test_an_unknown_name_lists_the_known(name: str) -> None:
    with pytest.raises(ValueError, match=r"no model .* in the zoo.*give one of: talker, walker"):
        make_agent(f"zoo:{name}")


def test_a_similar_name_is_suggested() -> None:
    with pytest.raises(ValueError, match=r"did you mean walker or talker\?"):
        make_agent("zoo:walk")


def test_a_changed_card_is_read_again_and_a_damaged_one_is_named(models: Path) -> None:
    file = models / "walker" / CARD
    assert find_model("walker").card.parameters == 3
    file.write_text(file.read_text().replace("parameters: 3", "parameters: 400"))
    assert find_model("walker").card.parameters == 400
    file.write_text("title: Plays\n")
    with pytest.raises(ValueError, match=r"walker/card\.yaml: the card"):
        make_agent("zoo:walker")
