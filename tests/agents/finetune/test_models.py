"""What is known of the models, and how much memory they take."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from agents.finetune.memory import GIB, OVERHEAD, Load, estimate, shape_of
from agents.finetune.models import choose_model, load_facts, model_names, picture_tokens


@pytest.mark.parametrize("name", model_names())
def test_the_sizes_give_the_published_number_of_parameters(name: str) -> None:
    facts = load_facts(name)
    assert facts.shape.parameters == facts.parameters


def test_memory_is_that_of_the_arithmetic() -> None:
    shape = load_facts("qwen2-vl-7b").shape
    vision = shape.vision
    assert vision is not None
    full = estimate(shape, Load(tokens=1000, gpus=8, sharded=True))
    learning = shape.parameters - vision.tower - vision.projector
    assert full.learning == learning == 7_615_616_512  # Qwen2-7B
    assert full.weights == shape.parameters * 2 // 8
    assert full.gradients == learning * 2 // 8
    assert full.optimizer == learning * 12 // 8
    assert full.logits == 1000 * 152_064 * 10
    assert full.total == OVERHEAD + sum(
        (full.weights, full.gradients, full.optimizer, full.activations, full.logits)
    )
    stored = estimate(shape, Load(tokens=1000, gpus=8, sharded=True, checkpointing=False))
    assert stored.activations > 10 * full.activations
    adapter = estimate(shape, Load(tokens=1000, lora_rank=8))
    assert adapter.learning == 20_185_088  # what PEFT counts for rank 8 on all linear layers
    assert adapter.weights == shape.parameters * 2 + adapter.learning * 4
    token = estimate(shape, Load(tokens=1000, lora_rank=8, new_tokens=True))
    assert token.learning - adapter.learning == 2 * 152_064 * 3584
    assert token.total - adapter.total == (token.learning - adapter.learning) * 16 > 16 * GIB
    learns = estimate(shape, Load(tokens=1000, freeze=("projector",)))
    assert learns.learning == learning + vision.tower


def test_pictures_are_read_as_the_image_processor_reads_them() -> None:
    smart_resize = pytest.importorskip("transformers.models.qwen2_vl.image_processing_pil_qwen2_vl")
    for name in ("qwen2-vl-7b", "qwen3-vl-4b"):
        shape = load_facts(name).shape
        assert shape.vision is not None
        side = shape.vision.patch * shape.vision.merge
        for width, height in ((800, 450), (1600, 900), (40, 30), (224, 1120), (640, 480)):
            for most in (180_000, 262_144, 12_845_056):
                rows, columns = smart_resize.smart_resize(
                    height, width, factor=side, min_pixels=3136, max_pixels=most
                )
                tokens = rows * columns // side**2
                assert picture_tokens(shape, width, height, 3136, most) == tokens


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


def test_a_configuration_without_a_number_is_named() -> None:
    facts = load_facts("qwen2.5-vl-3b")
    text = {key: value for key, value in facts.config["text_config"].items() if "layers" not in key}
    with pytest.raises(ValueError, match="lacks 'num_hidden_layers'"):
        shape_of({**facts.config, "text_config": text})
    assert replace(facts.shape, vision=None).parameters < facts.parameters
