"""The estimate of memory, compared with the models themselves and with what autograd keeps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
import torch
import transformers
from tiny_qwen import FAMILIES

from agents.finetune.memory import (
    ModelDimensions,
    TuningSetup,
    dimensions_of,
    estimate_memory,
    trained_parameters,
)

QWEN_2_5_VL_7B: dict[str, Any] = {
    "model_type": "qwen2_5_vl", "hidden_size": 3584, "intermediate_size": 18944,
    "num_hidden_layers": 28, "num_attention_heads": 28, "num_key_value_heads": 4,
    "vocab_size": 152064, "tie_word_embeddings": False,
    "vision_config": {
        "depth": 32, "hidden_size": 1280, "intermediate_size": 3420, "num_heads": 16,
        "out_hidden_size": 3584, "patch_size": 14, "spatial_patch_size": 14,
        "fullatt_block_indexes": [7, 15, 23, 31],
    },
}  # fmt: skip
"""As its config.json has them, in the layout of 2025."""


def plan(**changes: Any) -> TuningSetup:
    given: dict[str, Any] = {
        "precision": "bfloat16", "lora_rank": None, "freeze": ("vision", "projector"),
        "checkpointing": True, "batch": 1, "tokens": 8_192, "learnt": 2_000, "patches": 20_000,
    }  # fmt: skip
    return TuningSetup(**{**given, **changes})


def test_parameters_are_counted_as_the_model_has_them() -> None:
    for family, fields in [*FAMILIES.items(), ("7B", QWEN_2_5_VL_7B)]:
        config = transformers.AutoConfig.for_model(**fields)
        maker: Any = transformers.AutoModelForImageTextToText
        if "vision_config" not in fields:
            maker = transformers.AutoModelForCausalLM
        with torch.device("meta"):
            model = maker.from_config(config)
        counted = sum(each.numel() for each in model.parameters())
        assert dimensions_of(config.to_dict()).parameters == pytest.approx(counted, rel=0.02), (
            family
        )


def test_the_paper_s_model_takes_what_is_known_of_it() -> None:
    """Full fine-tuning of 7 B parameters needs several GPUs of 80 GB, LoRA one."""
    numbers = dimensions_of(QWEN_2_5_VL_7B)
    full = estimate_memory(numbers, plan())
    assert 100 < full.total / 2**30 < 160
    assert estimate_memory(numbers, plan(lora_rank=8)).total / 2**30 < 40
    assert estimate_memory(numbers, plan(gpus=8)).total < full.total / 3
    assert trained_parameters(numbers, plan(lora_rank=8)) == 20_185_088  # PEFT counts as many
    assert full.activations < estimate_memory(numbers, plan(checkpointing=False)).activations / 5


@pytest.mark.parametrize("checkpointing", [False, True])
def test_activations_are_what_autograd_keeps(checkpointing: bool) -> None:
    numbers = ModelDimensions(6, 128, 256, 512, 4, 2, 32, tied=False)
    config = transformers.AutoConfig.for_model(
        "qwen2", hidden_size=128, intermediate_size=256, num_hidden_layers=6, vocab_size=512,
        num_attention_heads=4, num_key_value_heads=2, use_cache=False,
    )  # fmt: skip
    model = transformers.AutoModelForCausalLM.from_config(config).train()
    if checkpointing:
        model.activation_checkpointing_enable({"use_reentrant": False})
    weights = {each.data_ptr() for each in model.parameters()}
    kept: dict[int, int] = {}

    def keep(tensor: torch.Tensor) -> torch.Tensor:
        storage = tensor.untyped_storage()
        if storage.data_ptr() not in weights:
            kept[storage.data_ptr()] = storage.nbytes()
        return tensor

    with torch.autograd.graph.saved_tensors_hooks(keep, lambda tensor: tensor):
        model.model(torch.zeros((2, 500), dtype=torch.long))
    made = plan(precision="float32", checkpointing=checkpointing, batch=2, tokens=500, on_gpu=False)
    once = 0
    if checkpointing:  # the hooks do not see the layer that is computed again
        one, two = (
            estimate_memory(
                replace(numbers, layers=layers), replace(made, checkpointing=False)
            ).activations
            for layers in (1, 2)
        )
        once = 2 * (two - one)
    found = estimate_memory(numbers, made).activations - once
    assert found == pytest.approx(sum(kept.values()), rel=0.1)
