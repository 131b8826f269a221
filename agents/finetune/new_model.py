"""Makes a new model: a tokenizer trained on texts, random weights, and a processor.

The directory is laid out as ``save_pretrained`` lays it out, so every program that loads such
models loads it: a transformers architecture, a byte-level BPE tokenizer with Qwen's special tokens
and chat format, and for a model with vision Qwen's image processor.
"""

from __future__ import annotations

import filecmp
import json
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import torch
import transformers
from tokenizers import Regex, Tokenizer, decoders, models, pre_tokenizers, trainers

from agents.finetune.architecture import BYTES, Architecture
from agents.finetune.libraries import quiet_libraries
from er_gym.activity import begin

PAD, BEGIN, END = "<|endoftext|>", "<|im_start|>", "<|im_end|>"
FEEDBACK = "<|feedback|>"
SPECIAL = (
    PAD,
    BEGIN,
    END,
    "<|vision_start|>",
    "<|vision_end|>",
    "<|image_pad|>",
    "<|video_pad|>",
    FEEDBACK,
)
"""The special tokens, in the order of their ids, after the learnt ones."""
_ROLES = {"image": "image_pad", "video": "video_pad", "vision_start": "vision_start"}
_ROLES |= {"vision_end": "vision_end"}
# Tags, words with the space before them, single digits, runs of signs, line ends.
_WORDS = r"</?\p{L}+>| ?\p{L}+|\p{N}| ?[^\s\p{L}\p{N}]+|\s*[\r\n]|\s+(?!\S)|\s+"
# OpenAI's CLIP, whose values Qwen's models use.
_MEAN, _STD = [0.48145466, 0.4578275, 0.40821073], [0.26862954, 0.26130258, 0.27577711]
_TEMPLATE = """\
{%- for message in messages -%}
<|im_start|>{{ message.role }}
{% if message.content is string -%}
{{ message.content }}
{%- else -%}
{%- for part in message.content -%}
{{ '<|vision_start|><|image_pad|><|vision_end|>' if part.type == 'image' else part.text }}
{%- endfor -%}
{%- endif -%}
<|im_end|>
{% endfor -%}
{%- if add_generation_prompt -%}
<|im_start|>assistant
{% endif -%}
"""


def make_model(
    architecture: Architecture, texts: Iterable[str], directory: Path, seed: int = 0
) -> Path:
    """Write a new model, its tokenizer and its processor.

    Args:
        architecture: what is made.
        texts: what the tokenizer is learnt from, such as the conversations of a collection. They
            are read once, and only if the vocabulary has more than the bytes.
        directory: appears when it is whole. One that holds this very model is left as it is, so
            that a command that was interrupted just after it can be given again.
        seed: of the weights.

    Returns:
        ``directory``.

    Raises:
        ValueError: the directory exists and holds anything else, or transformers does not accept
            the architecture.
    """
    check_free(directory)
    begin("learning the tokenizer from the conversations")
    tokenizer = make_tokenizer(texts, architecture.vocabulary)
    begin("making the weights")
    config = _config(architecture, tokenizer)
    model = random_model(config, seed, architecture.sees)
    processor = _image_processor(config) if architecture.sees else None
    return save_model(model, tokenizer, directory, processor)


def random_model(config: transformers.PretrainedConfig, seed: int, sees: bool = False) -> Any:
    """A model with random weights, float32.

    Raises:
        ValueError: transformers does not accept the configuration.
    """
    maker = transformers.AutoModelForImageTextToText if sees else transformers.AutoModelForCausalLM
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        try:
            return maker.from_config(config, dtype=torch.float32)
        except (ValueError, TypeError, RuntimeError, ZeroDivisionError) as error:
            problem = " ".join(str(error).split())[:300]
            raise ValueError(
                f"transformers does not accept this {config.model_type}: {problem}"
            ) from None


def check_free(directory: Path) -> None:
    """Raise ValueError if the directory exists and holds no model."""
    if directory.exists() and not (directory / transformers.CONFIG_NAME).is_file():
        raise _taken(directory)


def save_model(
    model: Any, tokenizer: Any, directory: Path, processor: Mapping[str, Any] | None = None
) -> Path:
    """Write a model, its tokenizer and its image processor's settings; all or nothing.

    Raises:
        ValueError: the directory exists and holds anything else than this very model.
    """
    ends = [tokenizer.eos_token_id, tokenizer.pad_token_id]
    model.generation_config = transformers.GenerationConfig(
        eos_token_id=list(dict.fromkeys(ends)), pad_token_id=ends[1], do_sample=False
    )
    begin(f"writing {directory}")
    directory.parent.mkdir(parents=True, exist_ok=True)
    with (
        quiet_libraries(),
        tempfile.TemporaryDirectory(dir=directory.parent, prefix=f".{directory.name}-") as folder,
    ):
        made = Path(folder) / "model"
        tokenizer.save_pretrained(made)
        model.save_pretrained(made)
        if processor is not None:
            text = json.dumps(processor, indent=2) + "\n"
            (made / "preprocessor_config.json").write_text(text, encoding="utf-8")
        if not directory.exists():
            shutil.move(made, directory)
        elif not _same_files(made, directory):
            raise _taken(directory)
    return directory


def _same_files(one: Path, other: Path) -> bool:
    """Whether two folders have the same files, with the same contents."""
    names = sorted(file.name for file in one.iterdir())
    if names != sorted(file.name for file in other.iterdir()):
        return False
    _, different, unreadable = filecmp.cmpfiles(one, other, names, shallow=False)
    return not different and not unreadable


def _taken(directory: Path) -> ValueError:
    return ValueError(
        f"{directory} exists and does not hold this model; give another directory, or remove it"
    )


def make_tokenizer(texts: Iterable[str], vocabulary: int) -> transformers.PreTrainedTokenizerFast:
    """A byte-level BPE tokenizer learnt from texts, with the special tokens and a chat template.

    Args:
        texts: what it is learnt from.
        vocabulary: the number of tokens, without the special ones; with 256, each byte is a token.
    """
    letters = sorted(pre_tokenizers.ByteLevel.alphabet())
    words = Tokenizer(models.BPE(vocab={each: i for i, each in enumerate(letters)}, merges=[]))
    split = pre_tokenizers.Split(Regex(_WORDS), "isolated")
    as_bytes = pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False)
    words.pre_tokenizer = pre_tokenizers.Sequence([split, as_bytes])
    words.decoder = decoders.ByteLevel()
    if vocabulary > BYTES:
        trainer = trainers.BpeTrainer(
            vocab_size=vocabulary, initial_alphabet=letters, show_progress=False
        )
        words.train_from_iterator(texts, trainer)
    tokenizer = transformers.PreTrainedTokenizerFast(
        tokenizer_object=words,
        eos_token=END,
        pad_token=PAD,
        additional_special_tokens=list(SPECIAL),
        clean_up_tokenization_spaces=False,
    )
    tokenizer.chat_template = _TEMPLATE
    return tokenizer


def _config(architecture: Architecture, tokenizer: Any) -> transformers.PretrainedConfig:
    """The model's configuration with the tokenizer's ids.

    Raises:
        ValueError: transformers does not accept the fields.
    """
    of_tokenizer = {
        "vocab_size": len(tokenizer),
        "bos_token_id": None,
        "eos_token_id": tokenizer.eos_token_id,
        "pad_token_id": tokenizer.pad_token_id,
    }
    fields: Mapping[str, Any] = {**architecture.text, **of_tokenizer}
    if architecture.sees:
        fields = {
            "text_config": fields,
            "vision_config": dict(architecture.vision),
            "tie_word_embeddings": bool(architecture.text.get("tie_word_embeddings")),
            **{
                f"{role}_token_id": tokenizer.convert_tokens_to_ids(f"<|{token}|>")
                for role, token in _ROLES.items()
            },
        }
    try:
        return transformers.AutoConfig.for_model(architecture.family, **fields)
    except Exception as error:  # transformers checks with several libraries' exceptions
        problem = " ".join(str(error).split())[:300]
        raise ValueError(
            f"transformers does not accept this {architecture.family}: {problem}"
        ) from None


def _image_processor(config: Any) -> dict[str, Any]:
    """The settings of Qwen's image processor for a vision tower."""
    vision = config.vision_config
    return {
        "image_processor_type": "Qwen2VLImageProcessor",
        "patch_size": vision.patch_size,
        "temporal_patch_size": vision.temporal_patch_size,
        "merge_size": vision.spatial_merge_size,
        "min_pixels": 3_136,
        "max_pixels": 12_845_056,
        "image_mean": _MEAN,
        "image_std": _STD,
    }
