"""The token ``<|feedback|>``, which is added to the model's vocabulary.

The paper's released code gives it the id 151657, which on Qwen2.5 is ``<tool_call>``. Here it gets
the next free id.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import torch
from transformers import AddedToken

from agents.finetune.tokens import FEEDBACK
from er_gym.data.chat import Chat

_MEANING = "feedback: the last action failed"
"""Words that describe it; its embeddings begin as the mean of theirs."""


def needs_feedback(chats: Iterable[Chat]) -> bool:
    """Whether the token occurs in the conversations."""
    return any(FEEDBACK in turn.text for chat in chats for turn in chat.turns)


def add_feedback(tokenizer: Any) -> None:
    """Make ``<|feedback|>`` a special token of a tokenizer, with the next free id."""
    # Not as one of the model's "additional special tokens", which would replace those.
    tokenizer.add_tokens([AddedToken(FEEDBACK, special=True, normalized=False)])


def add_rows(model: Any, tokenizer: Any) -> None:
    """Give ``<|feedback|>`` its rows in the model: its input and its output embedding.

    Models often have more rows than tokens; then one of these is taken, else rows are added. Both
    begin as the mean of the rows of words that say what it means.
    """
    token = tokenizer.convert_tokens_to_ids(FEEDBACK)
    if model.get_input_embeddings().weight.shape[0] <= token:
        model.resize_token_embeddings(token + 1, mean_resizing=False)
    like = tokenizer(_MEANING, add_special_tokens=False)["input_ids"]
    layers = (model.get_input_embeddings(), model.get_output_embeddings())
    for weight in {id(layer.weight): layer.weight for layer in layers}.values():
        with _whole(weight), torch.no_grad():
            weight[token] = weight[like].float().mean(dim=0).to(weight.dtype)


@contextmanager
def _whole(weight: Any) -> Iterator[None]:
    """With DeepSpeed's ZeRO-3, put a weight together, and spread it again. (Not run: no GPU.)"""
    if not hasattr(weight, "ds_id"):
        yield
        return
    import deepspeed

    with deepspeed.zero.GatheredParameters([weight], modifier_rank=0):
        yield
