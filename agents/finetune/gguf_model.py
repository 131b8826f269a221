"""Makes a model directory of a GGUF file, which llama.cpp's models come in."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
import transformers
from gguf import GGUF_MAGIC

from agents.finetune.libraries import quiet_libraries
from agents.finetune.new_model import check_free, random_model, save_model
from agents.vlm.clients.checkpoint import error_summary
from er_gym.activity import begin

MAGIC = GGUF_MAGIC.to_bytes(4, "little")


def model_of_gguf(file: Path, directory: Path, random_seed: int | None = None) -> Path:
    """Write the language model in a GGUF file as ``save_pretrained`` does, with its tokenizer.

    Quantised weights become float32. transformers knows the architectures of many such files, not
    all of them.

    Args:
        file: the model. It is read as data; nothing in it is run.
        directory: appears when it is whole; one that holds this very model is left as it is.
        random_seed: draw random weights with this seed instead of the file's, for comparison.

    Returns:
        ``directory``.

    Raises:
        ValueError: the file is no GGUF file that transformers can load, it has no chat template, or
            the directory exists and holds anything else.
    """
    check_free(directory)
    try:
        with file.open("rb") as opened:
            magic = opened.read(len(MAGIC))
    except OSError as error:
        raise ValueError(f"{file} cannot be read: {error.strerror}") from None
    if magic != MAGIC:
        raise ValueError(f"{file} is no GGUF file; give one, such as SmolLM2-135M.Q4_1.gguf")
    begin(f"reading {file}")
    tokenizer = _loaded(transformers.AutoTokenizer, file)
    if not tokenizer.chat_template:
        raise ValueError(
            f"{file} has no chat template, so it cannot hold a conversation; give an instruct model"
        )
    if tokenizer.pad_token_id is None:
        tokenizer.pad_token = tokenizer.eos_token
    config = _loaded(transformers.AutoConfig, file)
    config.__dict__.pop("quantization_config", None)  # the weights are written as float32
    model = random_model(config, random_seed or 0)
    if random_seed is None:
        model.load_state_dict(
            _loaded(transformers.AutoModelForCausalLM, file, dtype=torch.float32).state_dict()
        )
    return save_model(model, tokenizer, directory)


def _loaded(maker: Any, file: Path, **arguments: Any) -> Any:
    try:
        with quiet_libraries():
            return maker.from_pretrained(
                file.parent, gguf_file=file.name, local_files_only=True, **arguments
            )
    except Exception as error:  # what a strange file makes of the libraries can be any exception
        raise ValueError(f"transformers cannot load {file}: {error_summary(error)}") from None
