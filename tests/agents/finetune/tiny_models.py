"""Tiny models to fine-tune: real architectures with random weights, and a tokenizer that knows the
words of the training texts, so that conversations are a few hundred tokens."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tiny_qwen import SPECIAL, make_tiny_qwen

from er_gym.data.chat import Chat

HIDDEN = 64
WORDS = 600
_PLACES = ("image_pad", "video_pad", "vision_start", "vision_end")


def make_model(
    directory: Path, chats: Iterable[Chat], family: str = "qwen2_5_vl", spare: int = 0
) -> Path:
    """Write a model of a family of :mod:`tiny_qwen`.

    Args:
        directory: where to.
        chats: what its words are taken from.
        family: ``qwen2_5_vl`` or ``qwen2``.
        spare: how many more rows its embeddings have than there are tokens.
    """
    import torch
    import transformers

    make_tiny_qwen(directory, family=family)
    template = transformers.AutoTokenizer.from_pretrained(directory).chat_template
    tokenizer = _tokenizer(chats, template)
    tokenizer.save_pretrained(directory)
    ids = dict(zip(SPECIAL, tokenizer.convert_tokens_to_ids(list(SPECIAL)), strict=True))

    config = json.loads((directory / "config.json").read_text())
    text = config.get("text_config", config)
    text.update(
        vocab_size=len(tokenizer) + spare, hidden_size=HIDDEN, intermediate_size=2 * HIDDEN,
        num_attention_heads=4, num_key_value_heads=2, initializer_range=0.05,
        eos_token_id=ids["<|im_end|>"],
    )  # fmt: skip
    if "vision_config" in config:
        config["vision_config"].update(out_hidden_size=HIDDEN, initializer_range=0.05)
        text["rope_parameters"]["mrope_section"] = [2, 3, 3]
        for place in _PLACES:
            config[f"{place.removesuffix('_pad')}_token_id"] = ids[f"<|{place}|>"]
    _write(directory / "config.json", config)
    generation = json.loads((directory / "generation_config.json").read_text())
    ends = {"eos_token_id": ids["<|im_end|>"], "pad_token_id": ids["<|endoftext|>"]}
    _write(directory / "generation_config.json", generation | ends | {"repetition_penalty": 1.0})

    maker: Any = transformers.AutoModelForCausalLM
    if "vision_config" in config:
        maker = transformers.AutoModelForImageTextToText
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        made = maker.from_config(transformers.AutoConfig.from_pretrained(directory)).float()
    with torch.no_grad():
        # Wide, so that an adapter, which leaves it as it is, can be sure of a word.
        made.lm_head.weight *= 6
    made.save_pretrained(directory)
    return directory


def _tokenizer(chats: Iterable[Chat], template: str) -> Any:
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers
    from transformers import PreTrainedTokenizerFast

    words = Tokenizer(models.BPE())
    words.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    words.decoder = decoders.ByteLevel()
    texts = [
        part.replace("<|feedback|>", "")
        for chat in chats for turn in chat.turns for part in turn.parts if isinstance(part, str)
    ]  # fmt: skip
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    words.train_from_iterator(
        texts,
        trainers.BpeTrainer(vocab_size=WORDS, initial_alphabet=alphabet, show_progress=False),
    )
    tokenizer = PreTrainedTokenizerFast(
        tokenizer_object=words,
        eos_token="<|im_end|>",
        pad_token="<|endoftext|>",
        additional_special_tokens=list(SPECIAL),
        clean_up_tokenization_spaces=False,
    )
    tokenizer.chat_template = template
    return tokenizer


def _write(file: Path, fields: dict[str, Any]) -> None:
    file.write_text(json.dumps(fields, indent=2) + "\n", encoding="utf-8")
