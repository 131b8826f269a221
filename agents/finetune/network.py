"""The model that is trained: its weights, and which of them learn."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import peft
import torch

from agents.finetune import machine
from agents.finetune.feedback import FEEDBACK
from agents.finetune.model_files import ModelFiles
from agents.finetune.settings import Lora, ModelSettings
from agents.vlm.clients.adapters import adapter_chain, with_adapter
from agents.vlm.clients.checkpoint import error_summary, load_weights

_EYES = {"vision": r"model\.visual\.(?!.*merger)", "projector": r"model\.visual\..*merger"}
"""Names of the weights of each part that the settings can freeze."""


def chosen_dtype(settings: ModelSettings) -> str:
    """``bfloat16`` or ``float32``: in which a model is multiplied on this machine."""
    if settings.dtype == "auto":
        return "bfloat16" if machine.has_fast_bfloat16() else "float32"
    return settings.dtype


def load_network(files: ModelFiles, settings: ModelSettings, dtype: str) -> Any:
    """The model with its weights; adapters beneath are merged into it.

    Raises:
        ValueError: it cannot be loaded, or some of its weights are missing.
    """
    try:
        network, missing = load_weights(
            files.base,
            files.config,
            dtype=dtype,
            attn_implementation=settings.attention or None,
            local_files_only=True,
        )
        for adapter in adapter_chain(files.path)[1]:
            network = with_adapter(network, adapter, merge=True)
    except Exception as error:  # what broken files make of the libraries can be any exception
        raise ValueError(f"{files.path} cannot be loaded: {error_summary(error)}") from None
    if missing:
        raise ValueError(f"{files.base}: {missing}")
    return network


def with_learning_part(
    network: Any, settings: ModelSettings, files: ModelFiles, tokenizer: Any, feedback: bool
) -> Any:
    """The model of which only the weights that are to learn need gradients.

    Args:
        network: the model.
        settings: which weights learn; with ``lora`` those of an adapter, which is put on the model.
        files, tokenizer: the model's.
        feedback: whether the rows of ``<|feedback|>`` learn beside an adapter.

    Raises:
        ValueError: ``model.lora`` does not fit the model.
    """
    frozen = [re.compile(_EYES[part]) for part in settings.freeze]
    for name, weight in network.named_parameters():
        weight.requires_grad = not any(each.match(name) for each in frozen)
    if settings.lora is None:
        return network
    return _with_lora(network, settings.lora, settings, files, tokenizer, feedback)


def keep_learning_part_exact(network: Any) -> None:
    """Keep the weights that learn in float32: small steps would be lost in bfloat16."""
    for weight in network.parameters():
        if weight.requires_grad:
            weight.data = weight.data.float()


def learning_part(network: Any) -> dict[str, torch.Tensor]:
    """The weights that learn, by their names in the model; they share its memory."""
    return {
        name: weight.detach().contiguous()
        for name, weight in network.named_parameters()
        if weight.requires_grad
    }


def put_back(network: Any, weights: dict[str, torch.Tensor], where: str) -> None:
    """Write weights that :func:`learning_part` gave into a model.

    Raises:
        ValueError: they are of another model; ``where`` says whose they are.
    """
    own = learning_part(network)
    if weights.keys() != own.keys():
        raise ValueError(f"{where} does not fit the model; remove it")
    with torch.no_grad():
        for name, weight in own.items():
            weight.copy_(weights[name])


def _with_lora(
    network: Any,
    lora: Lora,
    settings: ModelSettings,
    files: ModelFiles,
    tokenizer: Any,
    feedback: bool,
) -> Any:
    """The model with an adapter that learns, and with it the rows of ``<|feedback|>``."""
    trained: dict[str, list[int]] | None = None
    if feedback:
        token = [tokenizer.convert_tokens_to_ids(FEEDBACK)]
        trained = {"embed_tokens": token}
        if not network.config.tie_word_embeddings:
            trained["lm_head"] = token
    frozen = "|".join(_EYES[part] for part in settings.freeze)
    config = peft.LoraConfig(
        task_type="CAUSAL_LM",
        r=lora.rank,
        lora_alpha=lora.alpha,
        lora_dropout=lora.dropout,
        target_modules=lora.targets if isinstance(lora.targets, str) else list(lora.targets),
        exclude_modules=f"({frozen}).*" if files.has_vision and frozen else None,
        trainable_token_indices=trained,
    )
    try:
        network = peft.get_peft_model(network, config)
    except ValueError as error:
        raise ValueError(f"model.lora does not fit the model: {error_summary(error)}") from None
    network.peft_config["default"].base_model_name_or_path = str(files.path)
    return network


def save_network(network: Any, files: ModelFiles, folder: Path) -> None:
    """Write a trained model, or its adapter, into a folder; its weights may be rounded after it."""
    if isinstance(network, peft.PeftModel):
        network.save_pretrained(str(folder), save_embedding_layers=False)
    else:
        network.config.use_cache = True
        network.to(files.config.dtype or torch.float32).save_pretrained(folder)
