"""A tiny Qwen with random weights: every part of a real checkpoint, 1 MB, made in a second.

What it says means nothing; that it reads pictures, keeps conversations apart and stops where it is
told to is what can be tested with it. Written as the real checkpoints are laid out, so that the
real loading code is what runs::

    python tests/agents/vlm/tiny_qwen.py DIRECTORY --family qwen3_vl
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

SPECIAL = (
    "<|endoftext|>",
    "<|im_start|>",
    "<|im_end|>",
    "<|vision_start|>",
    "<|vision_end|>",
    "<|image_pad|>",
    "<|video_pad|>",
)
THINK = ("<think>", "</think>")

# Qwen's format: <|im_start|>, the role, a line's end, the parts, <|im_end|>, a line's end.
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
{% if enable_thinking is defined -%}
{{ '<think>\n' if enable_thinking else '<think>\n\n</think>\n\n' }}
{%- endif -%}
{%- endif -%}
"""

_WORDS: dict[str, Any] = {
    "hidden_size": 32,
    "intermediate_size": 64,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "num_key_value_heads": 1,
    "max_position_embeddings": 16_384,
    # Wide, so that what is seen and where it stands changes what is said.
    "initializer_range": 0.3,
}
_EYES: dict[str, Any] = {
    "depth": 2,
    "hidden_size": 32,
    "num_heads": 2,
    "initializer_range": 0.3,
}
_ROPE = {"rope_type": "default", "rope_theta": 1e6, "mrope_section": [2, 3, 3]}

# What each family has beside that. No eyes: a language model alone.
FAMILIES: dict[str, dict[str, Any]] = {
    "qwen2": {"model_type": "qwen2", **_WORDS},
    "qwen2_vl": {
        "model_type": "qwen2_vl",
        "text_config": {**_WORDS, "rope_parameters": _ROPE},
        # hidden_size is the language model's here, and embed_dim the eyes'.
        "vision_config": {**_EYES, "embed_dim": 32, "mlp_ratio": 2, "patch_size": 14},
    },
    "qwen2_5_vl": {
        "model_type": "qwen2_5_vl",
        "text_config": {**_WORDS, "rope_parameters": _ROPE},
        "vision_config": {
            **_EYES,
            "intermediate_size": 64,
            "out_hidden_size": 32,
            "patch_size": 14,
            "fullatt_block_indexes": [1],
        },
    },
    "qwen3_vl": {
        "model_type": "qwen3_vl",
        "text_config": {
            **_WORDS,
            "head_dim": 16,
            "rope_parameters": {**_ROPE, "mrope_interleaved": True},
        },
        "vision_config": {
            **_EYES,
            "intermediate_size": 64,
            "out_hidden_size": 32,
            "patch_size": 16,
            "num_position_embeddings": 64,
            "deepstack_visual_indexes": [0],
        },
    },
}


def make_tiny_qwen(directory: str | Path, seed: int = 0, family: str = "qwen2_5_vl") -> Path:
    """Write a model, its tokenizer and its processor to a directory, and return that.

    Args:
        directory: made where it is missing.
        seed: of the weights.
        family: one of :data:`FAMILIES`.
    """
    import torch
    import transformers

    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    tokenizer = _tokenizer()
    tokenizer.save_pretrained(directory)
    ids = dict(zip(SPECIAL, tokenizer.convert_tokens_to_ids(list(SPECIAL)), strict=True))

    fields = dict(FAMILIES[family])
    tokens = {"vocab_size": len(tokenizer), "bos_token_id": None, "eos_token_id": ids["<|im_end|>"]}
    has_eyes = "vision_config" in fields
    if has_eyes:
        fields["text_config"] = fields["text_config"] | tokens
        fields |= {
            f"{name}_token_id": ids[f"<|{token}|>"]
            for name, token in (
                ("image", "image_pad"),
                ("video", "video_pad"),
                ("vision_start", "vision_start"),
                ("vision_end", "vision_end"),
            )
        }
        _write(
            directory / "preprocessor_config.json",
            image_processor_type="Qwen2VLImageProcessor",
            patch_size=fields["vision_config"]["patch_size"],
            temporal_patch_size=2,
            merge_size=2,
            min_pixels=3_136,
            max_pixels=12_845_056,
            image_mean=[0.48145466, 0.4578275, 0.40821073],
            image_std=[0.26862954, 0.26130258, 0.27577711],
        )
    else:
        fields |= tokens

    config = transformers.AutoConfig.for_model(**fields)
    maker = (
        transformers.AutoModelForImageTextToText if has_eyes else transformers.AutoModelForCausalLM
    )
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        model = maker.from_config(config, dtype=torch.float32)
    model.save_pretrained(directory)
    # As Qwen2.5-VL's makers have it: what is not asked for must not creep in.
    _write(
        directory / "generation_config.json",
        do_sample=True,
        temperature=1e-6,
        top_k=1,
        repetition_penalty=1.05,
        eos_token_id=[ids["<|im_end|>"], ids["<|endoftext|>"]],
        pad_token_id=ids["<|endoftext|>"],
    )
    return directory


def _tokenizer() -> Any:
    """A token for each byte, and Qwen's own."""
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers
    from transformers import AddedToken, PreTrainedTokenizerFast

    letters = sorted(pre_tokenizers.ByteLevel.alphabet())
    words = Tokenizer(models.BPE(vocab={each: i for i, each in enumerate(letters)}, merges=[]))
    words.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False, use_regex=False)
    words.decoder = decoders.ByteLevel()
    tokenizer = PreTrainedTokenizerFast(
        tokenizer_object=words,
        eos_token="<|im_end|>",
        pad_token="<|endoftext|>",
        additional_special_tokens=list(SPECIAL),
        clean_up_tokenization_spaces=False,
    )
    tokenizer.add_tokens([AddedToken(each, special=False, normalized=False) for each in THINK])
    tokenizer.chat_template = _TEMPLATE
    return tokenizer


def _write(file: Path, **fields: Any) -> None:
    file.write_text(json.dumps(fields, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Write a tiny Qwen with random weights.")
    parser.add_argument("directory")
    parser.add_argument("--family", choices=FAMILIES, default="qwen2_5_vl")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print(make_tiny_qwen(given.directory, given.seed, given.family))
