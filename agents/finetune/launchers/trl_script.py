"""Fine-tunes a Qwen-VL model with TRL on trajectories of er-gym: the turns that are to be learnt.

er-gym wrote this file and the data beside it. Run it as README.md says:

    accelerate launch train.py --config sft.yaml

``data/train`` is an image folder with the columns ``messages`` (blocks of text and places of
pictures), ``images``, and ``train``: whether each turn of the assistant is learnt.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import torch
from datasets import load_dataset
from peft import LoraConfig
from transformers import AddedToken, AutoModelForImageTextToText, AutoProcessor
from trl import ModelConfig, SFTConfig, SFTTrainer, TrlParser
from trl.trainer.sft_trainer import DataCollatorForVisionLanguageModeling

from er_gym.data.train_mask import train_mask

PARTS = {"vision": ".visual.", "projector": ".merger"}
"""Parts of a Qwen-VL model by what their parameters' names hold. A projector lies in the tower."""


@dataclass
class RunArguments:
    """What TRL has no argument for.

    Attributes:
        data: the folder of the data.
        min_pixels, max_pixels: a picture with fewer or more is scaled.
        freeze: parts that do not learn: ``vision``, ``projector``.
        special_tokens: tokens that the model does not have.
        meaning: words whose embeddings a new token's begins as the mean of.
    """

    data: str = "data"
    min_pixels: int = 3136
    max_pixels: int = 180_000
    freeze: list[str] = field(default_factory=lambda: ["vision", "projector"])
    special_tokens: list[str] = field(default_factory=list)
    meaning: str = "feedback: the last action failed"


class TurnCollator(DataCollatorForVisionLanguageModeling):
    """Gives loss to the turns of the assistant that are to be learnt, and to nothing else."""

    def torch_call(self, examples: list[dict[str, Any]]) -> dict[str, Any]:
        """A batch, with labels (B, L) of -100 wherever there is no loss."""
        batch: dict[str, Any] = super().torch_call(examples)
        tokenizer = self.processor.tokenizer
        begin = tokenizer("<|im_start|>assistant\n", add_special_tokens=False)["input_ids"]
        end = tokenizer("<|im_end|>", add_special_tokens=False)["input_ids"]
        for ids, labels, example in zip(batch["input_ids"], batch["labels"], examples, strict=True):
            learnt = train_mask(ids.tolist(), example["train"], begin=begin, end=end)
            labels[~torch.tensor(learnt)] = -100
        return batch


def main(run: RunArguments, training: SFTConfig, chosen: ModelConfig) -> None:
    """Load, train, save."""
    weights = str(chosen.model_name_or_path)
    processor = AutoProcessor.from_pretrained(weights)
    processor.image_processor.size = {
        "shortest_edge": run.min_pixels,
        "longest_edge": run.max_pixels,
    }
    model = AutoModelForImageTextToText.from_pretrained(
        weights,
        dtype=chosen.dtype,
        attn_implementation=chosen.attn_implementation,
    )
    new = add_tokens(processor.tokenizer, model, run)
    for name, parameter in model.named_parameters():
        if part_of(name) in run.freeze:
            parameter.requires_grad_(False)
    trainer = SFTTrainer(
        model=model,
        args=training,
        train_dataset=load_dataset("imagefolder", data_dir=run.data, split="train"),
        processing_class=processor,
        data_collator=TurnCollator(processor, max_length=training.max_length),
        peft_config=adapter(model, chosen, new) if chosen.use_peft else None,
    )
    trainer.train(resume_from_checkpoint=training.resume_from_checkpoint)
    trainer.save_model(training.output_dir)
    processor.save_pretrained(training.output_dir)


def add_tokens(tokenizer: Any, model: Any, run: RunArguments) -> list[int]:
    """Add the new tokens, their embeddings being the mean of those of words for their meaning."""
    known = tokenizer.get_vocab()
    new = [token for token in run.special_tokens if token not in known]
    tokenizer.add_tokens([AddedToken(token, special=True, normalized=False) for token in new])
    ids = [tokenizer.convert_tokens_to_ids(token) for token in new]
    if ids and len(tokenizer) > model.get_input_embeddings().weight.shape[0]:
        model.resize_token_embeddings(len(tokenizer))
    like = tokenizer(run.meaning, add_special_tokens=False)["input_ids"]
    for layer in (model.get_input_embeddings(), model.get_output_embeddings()):
        with torch.no_grad():
            for each in ids:
                layer.weight[each] = layer.weight[like].mean(dim=0)
    return ids


def part_of(name: str) -> str:
    """The part of the model that a parameter belongs to, ``""`` for the language model."""
    named = f".{name}"
    if PARTS["vision"] not in named:
        return ""
    return "projector" if PARTS["projector"] in named else "vision"


def adapter(model: Any, chosen: ModelConfig, new: list[int]) -> LoraConfig:
    """A LoRA on the linear layers of the language model; new tokens' embeddings learn, too."""
    linear = [
        name
        for name, module in model.named_modules()
        if isinstance(module, torch.nn.Linear) and not part_of(name) and "lm_head" not in name
    ]
    named = chosen.lora_target_modules
    wanted = linear if named in (None, "all-linear", ["all-linear"]) else named
    return LoraConfig(
        r=chosen.lora_r,
        lora_alpha=chosen.lora_alpha,
        lora_dropout=chosen.lora_dropout,
        target_modules=wanted,
        trainable_token_indices={"embed_tokens": new} if new else None,
        task_type="CAUSAL_LM",
    )


if __name__ == "__main__":
    parts: Any = (RunArguments, SFTConfig, ModelConfig)
    main(*TrlParser(parts).parse_args_and_config())
