"""Loads a model with transformers: its weights, tokenizer, image processor and chat template."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import transformers
from transformers.processing_utils import ProcessorMixin

from agents.vlm.settings import AgentSettings, Local

_MODEL_FILES = {".json", ".jinja", ".txt", ".model", ".safetensors", ".bin"}
_LONGEST_WORDS = 300  # characters of a library's, in an error
_OLD_WEIGHT_NAMES = {
    r"^visual\.": "model.visual.",
    r"^model\.(?!language_model\.|visual\.)": "model.language_model.",
}
"""The weight names in adapters for Qwen2-VL and Qwen2.5-VL that were trained with transformers 4.51
or older, and today's names. For whole models transformers converts them itself."""


@dataclass(frozen=True)
class Checkpoint:
    """A loaded model with what it needs to chat.

    Attributes:
        model: in evaluation mode; its ``generation_config`` follows the settings.
        tokenizer: the model's tokenizer.
        image_processor: turns pictures into patches; None for a text-only agent.
        template: the chat template; None for the tokenizer's own.
        end_tokens: the token ids that end a reply.
        identity: everything that its replies depend on, as JSON.
    """

    model: Any
    tokenizer: Any
    image_processor: Any
    template: str | None
    end_tokens: frozenset[int]
    identity: str


def load(path: str, settings: AgentSettings) -> Checkpoint:
    """Load a model; a local directory needs no network.

    Args:
        path: a directory that ``save_pretrained`` wrote, or a model's name on the Hugging Face hub.
        settings: of the agent.

    Raises:
        ValueError: the model or adapter does not exist, is broken, or does not fit the settings.
    """
    local, sees = settings.local, settings.sees == "pictures"
    is_here = Path(path).is_dir()
    if not is_here and (path.startswith(("/", ".", "~")) or path.count("/") > 1):
        raise ValueError(
            f"there is no directory {path}; give one with a model in it, or a model's name on the "
            "Hugging Face hub"
        )
    where = {"local_files_only": is_here}
    with _errors_in_one_line(f"{path} cannot be loaded"):
        config = transformers.AutoConfig.from_pretrained(path, **where)
        tokenizer = transformers.AutoTokenizer.from_pretrained(path, **where)
        # Some processors have their own template with pictures. If it comes in several variants,
        # the tokenizer's own template is the one for chat.
        template = ProcessorMixin.get_processor_dict(path, **where)[0].get("chat_template")
        template = template if isinstance(template, str) else None
    has_vision = getattr(config, "vision_config", None) is not None
    if sees and not has_vision:
        raise ValueError(f"{path} has no vision; set the agent's setting sees to text")
    if not (template or tokenizer.chat_template):
        raise ValueError(f"{path} has no chat template, so it cannot hold a conversation")
    with _errors_in_one_line(f"{path} cannot be loaded"):
        # With Pillow: a whole AutoProcessor needs torchvision, for videos only.
        image_processor = (
            transformers.AutoImageProcessor.from_pretrained(path, backend="pil", **where)
            if sees
            else None
        )
    if sees and not (hasattr(image_processor, "merge_size") and hasattr(config, "image_token_id")):
        raise ValueError(
            f"{path} does not process pictures as Qwen's models do "
            f"({type(image_processor).__name__}); run it on a server"
        )
    with _errors_in_one_line(f"{path} cannot be loaded"):
        model = _model(path, has_vision, local, where)
    ends, pad = _end_tokens(model, tokenizer), tokenizer.pad_token_id
    model.generation_config = transformers.GenerationConfig(
        do_sample=False,
        max_new_tokens=settings.sampling.max_tokens,
        eos_token_id=sorted(ends),
        pad_token_id=min(ends, default=None) if pad is None else pad,
        repetition_penalty=model.generation_config.repetition_penalty,
    )
    if local.adapter:
        model = _adapted(model, local.adapter)
    identity = _identity(path, settings, model)
    return Checkpoint(model.eval(), tokenizer, image_processor, template, ends, identity)


def one_line(error: Exception) -> str:
    """A library's error in one line of limited length."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:_LONGEST_WORDS]


def _model(path: str, has_vision: bool, local: Local, where: dict[str, bool]) -> Any:
    maker = (
        transformers.AutoModelForImageTextToText
        if has_vision
        else transformers.AutoModelForCausalLM
    )
    loaded: Any = maker.from_pretrained(
        path,
        dtype=local.dtype,
        device_map=local.device_map,
        attn_implementation=local.attention or None,
        output_loading_info=True,
        **where,
    )
    model, found = loaded  # a pair, for output_loading_info
    if missing := sorted(found["missing_keys"]):  # transformers would fill them with random values
        raise ValueError(f"{len(missing)} of its weights are missing, such as {missing[0]}")
    return model


def _end_tokens(model: Any, tokenizer: Any) -> frozenset[int]:
    theirs = model.generation_config.eos_token_id
    ends = {*(theirs if isinstance(theirs, list) else [theirs]), tokenizer.eos_token_id}
    return frozenset(ends - {None})


def _adapted(model: Any, adapter: str) -> Any:
    try:
        import peft
    except ImportError:
        raise ValueError("local.adapter needs peft: pip install 'er-gym[local]'") from None
    if not (Path(adapter) / "adapter_config.json").is_file():
        raise ValueError(
            f"local.adapter {adapter} is not an adapter; give a directory with adapter_config.json"
        )
    with (
        _errors_in_one_line(f"local.adapter {adapter} does not fit the model"),
        warnings.catch_warnings(),
    ):
        # peft only warns about an adapter that lacks some of its weights.
        warnings.filterwarnings("error", message="Found missing adapter keys")
        names = _OLD_WEIGHT_NAMES if model.config.model_type in ("qwen2_vl", "qwen2_5_vl") else None
        return peft.PeftModel.from_pretrained(model, adapter, key_mapping=names)


def _identity(path: str, settings: AgentSettings, model: Any) -> str:
    """See :class:`Checkpoint`. Size and time stand for a file's content, since hashing takes
    long."""
    what = {
        "client": "transformers",
        "model": _files(path) or [[path, getattr(model.config, "_commit_hash", None)]],
        "adapter": _files(settings.local.adapter) if settings.local.adapter else None,
        "dtype": str(model.dtype),
        "attention": settings.local.attention,
        "settings": settings.model_dump(
            mode="json",
            include={
                "seed": True,
                "sampling": True,
                "reasoning": True,
                "pictures": {"min_pixels", "max_pixels"},
            },
        ),
    }
    return json.dumps(what, sort_keys=True)


def _files(path: str) -> list[list[Any]]:
    """Name, size and modification time of the files of a model or an adapter."""
    directory = Path(path)
    if not directory.is_dir():
        return []
    files = (each.resolve() for each in directory.iterdir() if each.suffix in _MODEL_FILES)
    stats = ((str(each), each.stat()) for each in files)
    return sorted([name, stat.st_size, stat.st_mtime_ns] for name, stat in stats)


@contextmanager
def _errors_in_one_line(what: str) -> Iterator[None]:
    """Turn any error that a broken checkpoint causes in the libraries into a ValueError of one
    line."""
    try:
        yield
    except Exception as error:
        raise ValueError(f"{what}: {one_line(error)}") from None
