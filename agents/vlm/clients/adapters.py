"""LoRA adapters: one on a model, or several on one another, with tokens that they added."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

ADAPTER = "adapter_config.json"
_DEEPEST = 20
_OLD_WEIGHT_NAMES = {
    r"^visual\.": "model.visual.",
    r"^model\.(?!language_model\.|visual\.)": "model.language_model.",
}
"""The weight names in adapters for Qwen2-VL and Qwen2.5-VL that were trained with transformers 4.51
or older, and today's names. For whole models transformers converts them itself."""


def is_adapter(directory: Path) -> bool:
    """Whether a directory holds an adapter rather than a whole model."""
    return (directory / ADAPTER).is_file() and not (directory / "config.json").is_file()


def adapter_chain(directory: Path) -> tuple[Path, tuple[Path, ...]]:
    """The whole model beneath an adapter, and the adapters on it, the lowest first.

    An adapter's ``base_model_name_or_path`` may name the directory of another adapter. A directory
    that is no adapter is its own model, without adapters.

    Raises:
        ValueError: a model beneath is not a directory here.
    """
    found: list[Path] = []
    while is_adapter(directory):
        found.append(directory)
        told = json.loads((directory / ADAPTER).read_text(encoding="utf-8"))
        base = Path(str(told.get("base_model_name_or_path") or ""))
        if not base.is_absolute():
            base = directory / base
        if not base.is_dir() or len(found) > _DEEPEST:
            raise ValueError(
                f"the adapter {directory} is for the model {told.get('base_model_name_or_path')}, "
                "which is no directory here; write its place into base_model_name_or_path of "
                f"{directory / ADAPTER}"
            )
        directory = base
    return directory, tuple(reversed(found))


def base_directory(directory: Path) -> Path:
    """The whole model beneath an adapter; see :func:`adapter_chain`."""
    return adapter_chain(directory)[0]


def with_adapter(model: Any, adapter: Path, *, merge: bool = False) -> Any:
    """The model with an adapter.

    If the adapter's tokenizer has more tokens than the model has rows, rows are added first; the
    adapter brings their content.

    Args:
        model: the model that it was trained on.
        adapter: its directory.
        merge: write it into the model's weights; otherwise it stays apart.

    Raises:
        Exception: of any kind, if it does not fit the model.
    """
    import peft

    rows = _rows_wanted(adapter)
    if rows > model.get_input_embeddings().weight.shape[0]:
        model.resize_token_embeddings(rows, mean_resizing=False)
    names = _OLD_WEIGHT_NAMES if model.config.model_type in ("qwen2_vl", "qwen2_5_vl") else None
    with warnings.catch_warnings():
        # peft only warns about an adapter that lacks some of its weights.
        warnings.filterwarnings("error", message="Found missing adapter keys")
        warnings.filterwarnings("ignore", message=".*is_gradient_checkpointing")  # peft 0.21
        adapted = peft.PeftModel.from_pretrained(model, adapter, key_mapping=names)
    return adapted.merge_and_unload() if merge else adapted


def _rows_wanted(adapter: Path) -> int:
    """The rows that an adapter's own tokens need; 0 if it trained none."""
    told = json.loads((adapter / ADAPTER).read_text(encoding="utf-8"))
    trained = told.get("trainable_token_indices") or []
    lists = trained.values() if isinstance(trained, dict) else [trained]
    return max((each for ids in lists for each in ids), default=-1) + 1
