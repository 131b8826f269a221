"""LLaMA-Factory: a YAML file for ``llamafactory-cli train``, and data in ShareGPT form.

It has no loss flag for a turn. Where some turns are not learnt, every learnt turn becomes a sample
and ``mask_history`` trains on the last turn of each.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from agents.finetune.launchers.plan import (
    DATA,
    OUTPUT,
    LauncherFiles,
    LaunchPlan,
    Program,
    of_lora,
    of_transformers,
    yaml_text,
    zero3_text,
)
from agents.finetune.launchers.sources import SourceJob
from er_gym.data.exports.sharegpt import SHAREGPT

NAME = "llama-factory"
_ATTENTION = {"": "auto", "flash_attention_2": "fa2", "sdpa": "sdpa", "eager": "disabled"}
_TRAIN, _MERGE = "train.yaml", "merge.yaml"


def arguments(plan: LaunchPlan) -> dict[str, Any]:
    """The arguments of a run, by LLaMA-Factory's names."""
    model, data, training = plan.settings.model, plan.settings.data, plan.settings.training
    found: dict[str, Any] = {
        "model_name_or_path": plan.model.weights,
        "image_max_pixels": data.max_pixels,
        "image_min_pixels": data.min_pixels,
        "flash_attn": _ATTENTION.get(model.attention, model.attention),
        "stage": "sft",
        "do_train": True,
        "finetuning_type": "full" if model.lora is None else "lora",
        "freeze_vision_tower": "vision" in model.freeze,
        "freeze_multi_modal_projector": "projector" in model.freeze,
        "freeze_language_model": False,
        "disable_gradient_checkpointing": not training.checkpointing,
    }
    found |= of_lora(plan, "lora_rank", "lora_alpha", "lora_dropout", "lora_target")
    if model.lora is not None:
        targets = model.lora.targets
        found["lora_target"] = "all" if isinstance(targets, str) else ",".join(targets)
    if plan.facts.feedback:
        found |= {
            "new_special_tokens_config": f"{DATA}/special_tokens.yaml",
            "init_special_tokens": "desc_init",
        }
    found |= {
        "dataset": f"er_gym_train{'_turns' if plan.facts.partly else ''}",
        "dataset_dir": DATA,
        "template": plan.model.facts.programs[NAME],
        "cutoff_len": data.max_length,
        "mask_history": plan.facts.partly,
        "preprocessing_num_workers": 8,
        **of_transformers(plan),
        "report_to": "tensorboard",
        "warmup_ratio": training.warmup,
        "bf16": plan.half,
        "ddp_timeout": 180_000_000,
    }
    if training.buckets and training.batch > 1:
        found["train_sampling_strategy"] = "group_by_length"
    return found


def _merge(plan: LaunchPlan) -> dict[str, Any]:
    """The arguments of ``llamafactory-cli export``, which merges an adapter into the model."""
    found: dict[str, Any] = {
        "model_name_or_path": plan.model.weights,
        "adapter_name_or_path": OUTPUT,
        "template": plan.model.facts.programs[NAME],
        "finetuning_type": "lora",
        "export_dir": "model",
        "export_size": 5,
        "export_device": "cpu",
    }
    if plan.facts.feedback:
        found["new_special_tokens_config"] = f"{DATA}/special_tokens.yaml"
    return found


def _write(plan: LaunchPlan, folder: Path) -> LauncherFiles:
    job = SourceJob.of(plan.source, folder / DATA, per_turn=plan.facts.partly, copy=plan.copy)
    SHAREGPT.write(job)
    texts = {_TRAIN: yaml_text(arguments(plan)), **zero3_text(plan)}
    notes = [
        "LLaMA-Factory cuts a conversation that is longer than `cutoff_len`, pictures included, "
        "without an error: do not lower it below the length of the longest.",
    ]
    if plan.facts.partly:
        notes.append(
            "Some turns are not to be learnt. LLaMA-Factory has no flag for a turn, so every "
            "learnt turn is a sample of its own (`er_gym_train_turns`), which repeats what came "
            "before, and `mask_history: true` trains on its last turn alone."
        )
    if plan.facts.feedback:
        notes.append(
            f"`<|feedback|>` becomes the token {plan.model.facts.feedback_id}. The model's "
            "embedding has a spare row for it, so LLaMA-Factory neither adds a row nor applies "
            "`init_special_tokens`."
            + (
                " With LoRA it then trains the embedding and the output matrix as a whole, which "
                "the table of memory counts; to save that, delete `new_special_tokens_config` and "
                "`init_special_tokens`: the token is then read as ordinary pieces of text, and "
                "everything else works alike."
                if plan.settings.model.lora
                else ""
            )
        )
    if plan.settings.model.lora is not None:
        texts[_MERGE] = yaml_text(_merge(plan))
        notes.append(
            f"`llamafactory-cli export {_MERGE}` merges the adapter into the model, for serving or "
            "as the base of the next stage."
        )
    return LauncherFiles(
        texts=texts,
        command=("llamafactory-cli", "train", _TRAIN),
        environment={"FORCE_TORCHRUN": "1", "NPROC_PER_NODE": str(plan.gpus)},
        notes=tuple(notes),
        made_with="LLaMA-Factory 0.9.5",
    )


LLAMA_FACTORY = Program(NAME, _write)
