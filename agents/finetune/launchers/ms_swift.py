"""ms-swift: a YAML file for ``swift sft``, and messages with a loss flag for each turn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from agents.finetune.launchers.plan import (
    DATA,
    LauncherFiles,
    LaunchPlan,
    Program,
    of_lora,
    of_transformers,
    yaml_text,
    zero3_text,
)
from agents.finetune.launchers.sources import SourceJob
from er_gym.data.exports.ms_swift import MS_SWIFT as EXPORT
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN

NAME = "ms-swift"
_TRAIN = "train.yaml"
_EMBEDDINGS = ("embed_tokens", "lm_head")


def arguments(plan: LaunchPlan) -> dict[str, Any]:
    """The arguments of a run, by ms-swift's names. ``ENV`` are variables of the environment."""
    model, data, training = plan.settings.model, plan.settings.data, plan.settings.training
    build = plan.model.facts.programs[NAME]
    found: dict[str, Any] = {
        # Pictures are looked up here; the picture bounds are those of Qwen's own processor.
        "ENV": {
            "ROOT_IMAGE_DIR": DATA,
            "MIN_PIXELS": str(data.min_pixels),
            "MAX_PIXELS": str(data.max_pixels),
        },
        "model": plan.model.weights,
        "model_type": build,
        "template": build,
        "use_hf": True,
        "torch_dtype": "bfloat16" if plan.half else "float32",
        "tuner_type": "full" if model.lora is None else "lora",
        "freeze_llm": False,
        "freeze_vit": "vision" in model.freeze,
        "freeze_aligner": "projector" in model.freeze,
        "gradient_checkpointing": training.checkpointing,
        "vit_gradient_checkpointing": training.checkpointing and "vision" not in model.freeze,
    }
    if model.attention:
        found["attn_impl"] = model.attention
    found |= of_lora(plan, "lora_rank", "lora_alpha", "lora_dropout", "target_modules")
    if plan.facts.feedback:
        found["new_special_tokens"] = [FEEDBACK_TOKEN]
        if model.lora is not None:
            tied = plan.model.facts.numbers.tied
            found["modules_to_save"] = list(_EMBEDDINGS[:1] if tied else _EMBEDDINGS)
    found |= {
        "dataset": [f"{DATA}/train.jsonl"],
        "split_dataset_ratio": 0.0,
        "strict": True,
        "max_length": data.max_length,
        "truncation_strategy": "delete",
        "loss_scale": "default",
        "dataset_num_proc": 1,
        **of_transformers(plan),
        "add_version": False,
        "report_to": ["tensorboard"],
        "warmup_ratio": training.warmup,
        "data_seed": training.seed,
    }
    return found


def _write(plan: LaunchPlan, folder: Path) -> LauncherFiles:
    EXPORT.write(SourceJob.of(plan.source, folder / DATA, per_turn=False, copy=plan.copy))
    texts = {_TRAIN: yaml_text(arguments(plan)), **zero3_text(plan)}
    notes = [
        "`loss` in a message says whether a turn of the assistant is learnt; ms-swift heeds it."
    ]
    if plan.facts.feedback:
        notes.append(
            f"`<|feedback|>` becomes the token {plan.model.facts.feedback_id}, for which the "
            "model's embedding has a spare row."
            + (
                " `modules_to_save` trains the embedding as a whole, which the table of memory "
                "counts; to save that, delete `new_special_tokens` and `modules_to_save`."
                if plan.settings.model.lora
                else ""
            )
        )
    if plan.settings.model.lora is not None:
        notes.append("`swift export --adapters output/CHECKPOINT --merge_lora true` merges it.")
    return LauncherFiles(
        texts=texts,
        command=("swift", "sft", _TRAIN),
        environment={"NPROC_PER_NODE": str(plan.gpus)},
        notes=tuple(notes),
        made_with="ms-swift 4.6.0",
    )


MS_SWIFT = Program(NAME, _write)
