"""What is known of the models."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from agents.finetune.models import choose_model, load_facts, model_names, picture_tokens


@pytest.mark.parametrize("name", model_names())
def test_the_sizes_give_the_published_number_of_parameters(name: str) -> None:
    facts = load_facts(name)
    # The formula leaves out biases and norms.
    assert facts.numbers.parameters == pytest.approx(facts.parameters, rel=1e-3)
    assert facts.numbers.parameters < facts.parameters


@pytest.mark.parametrize(
    ("side", "width", "height", "tokens"),
    [
        (28, 800, 450, (220, 312, 464)),
        (28, 1600, 900, (220, 312, 1824)),
        (28, 40, 30, (6, 6, 6)),
        (28, 224, 1120, (198, 320, 320)),
        (32, 800, 450, (153, 252, 350)),
        (32, 224, 1120, (145, 245, 245)),
        (32, 300, 300, (81, 81, 81)),
    ],
)
def test_pictures_have_as_many_tokens_as_the_image_processor_makes(
    side: int, width: int, height: int, tokens: tuple[int, ...]
) -> None:
    """The counts are those of smart_resize in transformers 5.23."""
    bounds = (180_000, 262_144, 12_845_056)
    assert tokens == tuple(picture_tokens(side, width, height, 3136, most) for most in bounds)


def test_models_by_name_hub_weights_and_directory(tmp_path: Path) -> None:
    assert choose_model("qwen2-vl-7b").weights == "Qwen/Qwen2-VL-7B-Instruct"
    assert choose_model("Qwen/Qwen2-VL-7B-Instruct").name == "qwen2-vl-7b"
    assert choose_model("qwen2-vl-7b=/cluster/s1").weights == "/cluster/s1"
    facts = load_facts("qwen2.5-vl-3b")
    (tmp_path / "config.json").write_text(json.dumps(facts.config))
    assert choose_model(str(tmp_path)).name == "qwen2.5-vl-3b"
    smaller = {**facts.config, "text_config": {**facts.config["text_config"], "hidden_size": 64}}
    (tmp_path / "config.json").write_text(json.dumps(smaller))
    with pytest.raises(ValueError, match="of the size of none of qwen2-vl-2b"):
        choose_model(str(tmp_path))
    for wrong in ("gpt-5", "qwen2-vl-7b="):
        with pytest.raises(ValueError, match=r"qwen2-vl-2b|NAME=WEIGHTS"):
            choose_model(wrong)
