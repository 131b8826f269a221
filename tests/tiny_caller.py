"""A tiny language model that calls tools, for the test of TRL's trainer.

Its tokenizer has learnt a few transcripts by heart: each message is a token or two, so that a
trainer's steps cost little.
"""

from __future__ import annotations

import json
from typing import Any

import torch
from tokenizers import Regex, Tokenizer, decoders, models, pre_tokenizers, trainers
from transformers import PreTrainedTokenizerFast, Qwen3Config, Qwen3ForCausalLM
from trl.chat_template_utils import get_training_chat_template, qwen3_chat_template

_STEPS = 200
"""Of teaching."""


def tokenizer_of(texts: list[str]) -> PreTrainedTokenizerFast:
    """Byte-level BPE with Qwen3's chat template, which merges all that stands between tags.

    The template is TRL's copy, since TRL parses calls only with a template that it knows exactly.
    """
    bpe = Tokenizer(models.BPE())
    tags = Regex(r"</?tool_call>|</?think>|</?tool_response>|assistant\n|\n+")
    bpe.pre_tokenizer = pre_tokenizers.Sequence(
        [pre_tokenizers.Split(tags, "isolated"), pre_tokenizers.ByteLevel(False, use_regex=False)]
    )
    bpe.decoder = decoders.ByteLevel()
    special = ["<|endoftext|>", "<|im_start|>", "<|im_end|>"]
    alphabet = pre_tokenizers.ByteLevel.alphabet()
    bpe.train_from_iterator(
        texts,
        trainers.BpeTrainer(
            vocab_size=9000, special_tokens=special, initial_alphabet=alphabet, show_progress=False
        ),
    )
    return PreTrainedTokenizerFast(
        tokenizer_object=bpe,
        pad_token="<|endoftext|>",
        eos_token="<|im_end|>",
        chat_template=qwen3_chat_template,
    )


def called(calls: list[tuple[str, dict[str, str]]], answers: list[str]) -> list[dict[str, Any]]:
    """The messages of an assistant that makes some calls, with the answers of the tools."""
    messages: list[dict[str, Any]] = []
    for (name, arguments), answer in zip(calls, answers, strict=True):
        function = {"name": name, "arguments": arguments}
        call = {"type": "function", "function": function}
        messages.append({"role": "assistant", "content": "", "tool_calls": [call]})
        messages.append({"role": "tool", "name": name, "content": answer})
    return [*messages, {"role": "assistant", "content": "Done."}]


class TinyCaller:
    """A model fitted to two transcripts, which part at the first call.

    Args:
        transcripts: the messages of both.
        tools: what the model may call.
    """

    def __init__(self, transcripts: list[list[dict[str, Any]]], tools: list[Any]) -> None:
        template = {
            "tools": tools,
            "chat_template": get_training_chat_template(tokenizer_of([json.dumps(transcripts)])),
        }
        texts = tokenizer_of(["x"]).apply_chat_template(transcripts, tokenize=False, **template)
        self.tokenizer = tokenizer_of(texts)
        self._batch = self.tokenizer.apply_chat_template(
            transcripts,
            return_tensors="pt",
            return_dict=True,
            return_assistant_tokens_mask=True,
            padding=True,
            padding_side="right",
            **template,
        )
        torch.manual_seed(0)
        self.model = Qwen3ForCausalLM(
            Qwen3Config(
                vocab_size=len(self.tokenizer),
                hidden_size=32,
                intermediate_size=64,
                num_hidden_layers=2,
                num_attention_heads=2,
                num_key_value_heads=1,
                head_dim=16,
                tie_word_embeddings=True,
            )
        )
        optimizer = torch.optim.Adam(self.model.parameters(), 1e-2)
        for _ in range(_STEPS):
            optimizer.zero_grad()
            (-self.log_likelihood().mean() / 10).backward()
            optimizer.step()

    def log_likelihood(self) -> Any:
        """(2,) of all that the assistant says, in each transcript; log(1/2) at best."""
        ids = self._batch["input_ids"]  # padded on the right, where causal attention needs no mask
        logits = self.model(input_ids=ids).logits[:, :-1]
        each = torch.nn.functional.cross_entropy(
            logits.transpose(1, 2), ids[:, 1:], reduction="none"
        )
        return -(each * self._batch["assistant_masks"][:, 1:]).sum(1)

    def preference(self) -> float:
        """By how much, as a logarithm, the first transcript is likelier than the second."""
        with torch.no_grad():
            first, second = self.log_likelihood().tolist()
        return float(first - second)
