"""Tiny models for fine-tuning: real architectures, random weights, and a vocabulary of their own
that knows the words of the training texts, so that conversations are short."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tiny_qwen import FAMILIES, SPECIAL, make_tiny_qwen

from er_gym.data.chat import Chat

HIDDEN = 64


def make_model(
    directory: Path, chats: Iterable[Chat], family: str = "qwen2_5_vl", **changes: Any
) -> Path:
    """A model of a family, with a vocabulary of about a thousand words out of the conversations."""
    import torch
    import transformers

    make_tiny_qwen(directory, family=family)
    before = transformers.AutoTokenizer.from_pretrained(directory)
    tokenizer = _tokenizer(chats, before)
    tokenizer.save_pretrained(directory)
    config = json.loads((directory / "config.json").read_text())
    config.update(changes)
    ids = dict(zip(SPECIAL, tokenizer.convert_tokens_to_ids(list(SPECIAL)), strict=True))
    words = config.get("text_config", config)
    words |= {
        "vocab_size": len(tokenizer), "hidden_size": HIDDEN, "intermediate_size": 2 * HIDDEN,
        "num_attention_heads": 4, "num_key_value_heads": 2, "initializer_range": 0.05,
        "eos_token_id": ids["<|im_end|>"], "rope_parameters": FAMILIES["qwen2_5_vl"]["text_config"]["rope_parameters"] if "text_config" in config else words.get("rope_parameters"),
    }  # fmt: skip
    words.pop("head_dim", None)
    if "vision_config" in config:
        config["vision_config"] |= {"out_hidden_size": HIDDEN, "initializer_range": 0.05}
        for name, token in (("image", "image_pad"), ("video", "video_pad"),
                            ("vision_start", "vision_start"), ("vision_end", "vision_end")):  # fmt: skip
            config[f"{name}_token_id"] = ids[f"<|{token}|>"]
    (directory / "config.json").write_text(json.dumps(config))
    made = transformers.AutoConfig.from_pretrained(directory)
    maker = (
        transformers.AutoModelForImageTextToText
        if "vision_config" in config
        else transformers.AutoModelForCausalLM
    )
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        maker.from_config(made, dtype=torch.float32).save_pretrained(directory)
    generation = json.loads((directory / "generation_config.json").read_text())
    generation |= {
        "eos_token_id": ids["<|im_end|>"],
        "pad_token_id": ids["<|endoftext|>"],
        "repetition_penalty": 1.0,
    }
    (directory / "generation_config.json").write_text(json.dumps(generation))
    return directory


def _tokenizer(chats: Iterable[Chat], like: Any) -> Any:
    from tokenizers import Tokenizer, decoders, models, pre_tokenizers, trainers
    from transformers import PreTrainedTokenizerFast

    words = Tokenizer(models.BPE())
    words.pre_tokenizer = pre_tokenizers.ByteLevel(add_prefix_space=False)
    words.decoder = decoders.ByteLevel()
    trainer = trainers.BpeTrainer(
        vocab_size=1_000, initial_alphabet=pre_tokenizers.ByteLevel.alphabet(), show_progress=False
    )
    texts = [
        turn.text.replace("<image>", "").replace("<|feedback|>", "")
        for chat in chats
        for turn in chat.turns
    ]
    words.train_from_iterator(texts, trainer)
    made = PreTrainedTokenizerFast(
        tokenizer_object=words,
        eos_token="<|im_end|>",
        pad_token="<|endoftext|>",
        additional_special_tokens=list(SPECIAL),
        clean_up_tokenization_spaces=False,
    )
    made.chat_template = like.chat_template
    return made
