"""TRL: a script for ``SFTTrainer`` with a collator that uses each turn's flag, and its YAML."""

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
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN
from er_gym.data.exports.trl import TRL as EXPORT

NAME = "trl"
_SCRIPT, _CONFIG = "train.py", "sft.yaml"
_LAUNCH = ("accelerate", "launch", "--num_processes")
_SOURCE = Path(__file__).with_name("trl_script.py")


def arguments(plan: LaunchPlan) -> dict[str, Any]:
    """The arguments of a run: the script's own, ``SFTConfig``'s and ``ModelConfig``'s."""
    model, data, training = plan.settings.model, plan.settings.data, plan.settings.training
    found: dict[str, Any] = {
        "data": DATA,
        "min_pixels": data.min_pixels,
        "max_pixels": data.max_pixels,
        "freeze": list(model.freeze),
        "special_tokens": [FEEDBACK_TOKEN] if plan.facts.feedback else [],
        "model_name_or_path": plan.model.weights,
        "dtype": "bfloat16" if plan.half else "float32",
        "use_peft": model.lora is not None,
    }
    if model.attention:
        found["attn_implementation"] = model.attention
    found |= of_lora(plan, "lora_r", "lora_alpha", "lora_dropout", "lora_target_modules")
    found |= {
        "max_length": None,  # to cut a conversation would cut pictures
        "remove_unused_columns": False,  # the collator needs the column "train"
        "dataset_kwargs": {"skip_prepare_dataset": True},
        **of_transformers(plan),
        "report_to": ["tensorboard"],
        "gradient_checkpointing": training.checkpointing,
        "warmup_steps": training.warmup,  # below 1, a share of all
        "bf16": plan.half,
        "data_seed": training.seed,
    }
    return found


def _write(plan: LaunchPlan, folder: Path) -> LauncherFiles:
    EXPORT.write(SourceJob.of(plan.source, folder / DATA, per_turn=False, copy=plan.copy))
    texts = {
        _CONFIG: yaml_text(arguments(plan)),
        _SCRIPT: _SOURCE.read_text(encoding="utf-8"),
        **zero3_text(plan),
    }
    return LauncherFiles(
        texts=texts,
        command=(*_LAUNCH, str(plan.gpus), _SCRIPT, "--config", _CONFIG),
        environment={},
        notes=(
            f"`{_SCRIPT}` is TRL's `SFTTrainer` with a collator that gives loss to the turns "
            "marked `train`; it needs er-gym there, with `pip install trl peft datasets`.",
            "Nothing is cut off (`max_length: null`).",
        ),
        made_with="TRL 1.16.0 with transformers 5.23.0",
    )


TRL = Program(NAME, _write)
