"""Loads a model with transformers: its weights, tokenizer, image processor and chat template."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import transformers
from transformers.processing_utils import ProcessorMixin

from agents.vlm.clients.adapters import ADAPTER, adapter_chain, with_adapter
from agents.vlm.settings import AgentSettings
from agents.vlm.tuned_model import named_model
from er_gym.activity import begin
from er_gym.extras import MissingPackage

_MODEL_FILES = {".json", ".jinja", ".txt", ".model", ".safetensors", ".bin"}
_LONGEST_WORDS = 300  # characters of a library's, in an error
_TOKENIZER = "tokenizer_config.json"


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
        path: a directory that ``save_pretrained`` wrote, of a whole model or of an adapter; or a
            model's name on the Hugging Face hub; or a finished run of ``er-gym finetune``.
        settings: of the agent.

    Raises:
        ValueError: the model or adapter does not exist, is broken, or does not fit the settings.
    """
    path = named_model(path)
    begin(f"loading the weights of {path}")
    local, sees = settings.local, settings.sees == "pictures"
    is_here = Path(path).is_dir()
    where = {"local_files_only": is_here}
    whole, adapters = adapter_chain(Path(path)) if is_here else (Path(path), ())
    base = str(whole) if is_here else path
    if local.adapter:
        adapters = (*adapters, _adapter(local.adapter))
    # An adapter may have brought tokens of its own, and then it has a tokenizer that knows them.
    words = next((str(a) for a in reversed(adapters) if (a / _TOKENIZER).is_file()), base)
    with _errors_summarised(f"{path} cannot be loaded"):
        config = transformers.AutoConfig.from_pretrained(base, **where)
        tokenizer = transformers.AutoTokenizer.from_pretrained(words, **where)
        template = template_of(words, **where) or template_of(base, **where)
    has_vision = getattr(config, "vision_config", None) is not None
    if sees and not has_vision:
        raise ValueError(f"{path} has no vision; set the agent's setting sees to text")
    if not (template or tokenizer.chat_template):
        raise ValueError(f"{path} has no chat template, so it cannot hold a conversation")
    with _errors_summarised(f"{path} cannot be loaded"):
        # With Pillow: a whole AutoProcessor needs torchvision, for videos only.
        image_processor = (
            transformers.AutoImageProcessor.from_pretrained(base, backend="pil", **where)
            if sees
            else None
        )
    if sees and not (hasattr(image_processor, "merge_size") and hasattr(config, "image_token_id")):
        raise ValueError(
            f"{path} does not process pictures as Qwen's models do "
            f"({type(image_processor).__name__}); run it on a server"
        )
    with _errors_summarised(f"{path} cannot be loaded"):
        model, missing = load_weights(
            base,
            config,
            dtype=local.dtype,
            device_map=local.device_map,
            attn_implementation=local.attention or None,
            **where,
        )
        if missing:
            raise ValueError(missing)
    ends = _prepare(model, tokenizer, settings)
    for number, adapter in enumerate(adapters, 1):
        with _errors_summarised(f"the adapter {adapter} does not fit the model"):
            model = with_adapter(model, adapter, merge=number < len(adapters))
    identity = _identity(base, adapters, settings, model)
    return Checkpoint(model.eval(), tokenizer, image_processor, template, ends, identity)


def checkpoint_in_memory(
    model: Any, tokenizer: Any, image_processor: Any, template: str, settings: AgentSettings
) -> Checkpoint:
    """A model that is in memory already, such as one that is being trained, ready to chat.

    Its replies depend on weights that may change, so it has no ``identity``.
    """
    ends = _prepare(model, tokenizer, settings)
    return Checkpoint(model.eval(), tokenizer, image_processor, template, ends, identity="")


def _prepare(model: Any, tokenizer: Any, settings: AgentSettings) -> frozenset[int]:
    """Let a model generate by the settings; gives the tokens that end a reply."""
    ends, pad = _end_tokens(model, tokenizer), tokenizer.pad_token_id
    picture = model.config.image_token_id if settings.sees == "pictures" else None
    model.generation_config = transformers.GenerationConfig(
        do_sample=False,
        max_new_tokens=settings.sampling.max_tokens,
        eos_token_id=sorted(ends),
        pad_token_id=min(ends, default=None) if pad is None else pad,
        repetition_penalty=model.generation_config.repetition_penalty,
        # Where a picture goes; the model cannot be given it where none is.
        suppress_tokens=None if picture is None else [picture],
    )
    return ends


def template_of(path: str, **where: bool) -> str | None:
    """A processor's own chat template; None for the tokenizer's.

    Some processors have their own template with pictures. If it comes in several variants, the
    tokenizer's own template is the one for chat.
    """
    found = ProcessorMixin.get_processor_dict(path, **where)[0].get("chat_template")
    return found if isinstance(found, str) else None


def error_summary(error: Exception) -> str:
    """A library's error in one line of limited length."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:_LONGEST_WORDS]


def load_weights(path: str | Path, config: Any, **options: Any) -> tuple[Any, str]:
    """A model with its weights.

    Args:
        path: as ``from_pretrained`` takes it.
        config: the model's; one with vision is loaded with it.
        options: further arguments of ``from_pretrained``.

    Returns:
        the model; and which weights are missing, which transformers fills with random values, in
        words: "" for none.

    Raises:
        Exception: of any kind, if the files are broken.
    """
    maker: Any = transformers.AutoModelForCausalLM
    if getattr(config, "vision_config", None) is not None:
        maker = transformers.AutoModelForImageTextToText
    model, found = maker.from_pretrained(path, output_loading_info=True, **options)
    missing = sorted(found["missing_keys"])
    told = f"{len(missing)} of its weights are missing, such as {missing[0]}" if missing else ""
    return model, told


def _end_tokens(model: Any, tokenizer: Any) -> frozenset[int]:
    theirs = model.generation_config.eos_token_id
    ends = {*(theirs if isinstance(theirs, list) else [theirs]), tokenizer.eos_token_id}
    return frozenset(ends - {None})


def _adapter(directory: str) -> Path:
    if importlib.util.find_spec("peft") is None:
        raise MissingPackage("local.adapter", "peft", "er-gym[local]")
    if not (Path(directory) / ADAPTER).is_file():
        raise ValueError(
            f"local.adapter {directory} is not an adapter; give a directory with {ADAPTER}"
        )
    return Path(directory)


def _identity(path: str, adapters: Sequence[Path], settings: AgentSettings, model: Any) -> str:
    """See :class:`Checkpoint`. Size and time stand for a file's content, since hashing takes
    long."""
    what: dict[str, Any] = {
        "client": "transformers",
        "model": _files(path) or [[path, getattr(model.config, "_commit_hash", None)]],
        "adapter": [each for adapter in adapters for each in _files(str(adapter))] or None,
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
    pictures = settings.pictures
    if pictures.model_bounds != (pictures.min_pixels, pictures.max_pixels):
        what["model_bounds"] = pictures.model_bounds
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
def _errors_summarised(what: str) -> Iterator[None]:
    """Turn any error that a broken checkpoint causes in the libraries into a ValueError of one
    line."""
    try:
        yield
    except Exception as error:
        raise ValueError(f"{what}: {error_summary(error)}") from None
