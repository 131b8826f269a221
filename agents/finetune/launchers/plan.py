"""What every program's files are made from."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from agents.finetune.launchers.sources import DataFacts, Source
from agents.finetune.models import ChosenModel
from agents.finetune.settings import FinetuneSettings

DATA, OUTPUT = "data", "output"
"""The folders of the data and of what is trained, beside the printed files."""
ZERO3_FILE = "zero3.json"


@dataclass(frozen=True)
class LaunchPlan:
    """A run that is printed.

    Attributes:
        settings: of the run.
        model: what is tuned.
        source, facts: what on.
        gpus: on how many GPUs.
        copy: whether pictures are copied instead of linked.
    """

    settings: FinetuneSettings
    model: ChosenModel
    source: Source
    facts: DataFacts
    gpus: int
    copy: bool = False

    @property
    def name(self) -> str:
        """What the run is called: its stage."""
        return self.settings.stage or "tuning"

    @property
    def sharded(self) -> bool:
        """Whether ZeRO-3 divides the model among the GPUs."""
        return self.settings.model.lora is None and self.gpus > 1

    @property
    def half(self) -> bool:
        """Whether it calculates in bfloat16."""
        return self.settings.model.dtype != "float32"


@dataclass(frozen=True)
class LauncherFiles:
    """The files of a program.

    Attributes:
        texts: name to content.
        command: what to run in the folder.
        environment: variables that the command needs.
        notes: what a person should know, a paragraph each.
        made_with: the program and the version for which the files were checked.
    """

    texts: Mapping[str, str]
    command: tuple[str, ...]
    environment: Mapping[str, str]
    notes: tuple[str, ...]
    made_with: str


@dataclass(frozen=True)
class Program:
    """A row of the table of programs.

    Attributes:
        name: what ``--print`` takes.
        write: writes the data into a folder, and gives the other files.
    """

    name: str
    write: Callable[[LaunchPlan, Path], LauncherFiles]


def of_transformers(plan: LaunchPlan) -> dict[str, Any]:
    """Arguments of transformers' ``TrainingArguments``, which these programs take by its names."""
    training = plan.settings.training
    return {
        "output_dir": OUTPUT,
        "logging_steps": training.log_every,
        "save_steps": training.save_every,
        "save_total_limit": training.keep,
        "per_device_train_batch_size": training.batch,
        "gradient_accumulation_steps": training.accumulation,
        "learning_rate": training.learning_rate,
        "num_train_epochs": training.epochs,
        "weight_decay": training.weight_decay,
        "max_grad_norm": training.max_grad_norm,
        "lr_scheduler_type": "cosine",
        "seed": training.seed,
        "dataloader_num_workers": 4,
        **({"deepspeed": ZERO3_FILE} if plan.sharded else {}),
    }


def of_lora(plan: LaunchPlan, rank: str, alpha: str, dropout: str, targets: str) -> dict[str, Any]:
    """The arguments of the adapter, by the names that a program has for them; none without one."""
    lora = plan.settings.model.lora
    if lora is None:
        return {}
    named = [lora.targets] if isinstance(lora.targets, str) else list(lora.targets)
    return {rank: lora.rank, alpha: lora.alpha, dropout: lora.dropout, targets: named}


def yaml_text(arguments: Mapping[str, Any]) -> str:
    """Arguments as YAML, in their order."""
    return yaml.safe_dump(arguments, sort_keys=False, allow_unicode=True)


def zero3_text(plan: LaunchPlan) -> dict[str, str]:
    """The file for ZeRO-3 and its content; none for a run that is not divided among GPUs."""
    return {ZERO3_FILE: json.dumps(zero3(plan), indent=2) + "\n"} if plan.sharded else {}


def zero3(plan: LaunchPlan) -> dict[str, Any]:
    """DeepSpeed's configuration for ZeRO-3. Transformers fills in what is ``auto``."""
    return {
        "train_batch_size": "auto",
        "train_micro_batch_size_per_gpu": "auto",
        "gradient_accumulation_steps": "auto",
        "gradient_clipping": "auto",
        "zero_allow_untested_optimizer": True,
        "bf16": {"enabled": plan.half},
        "zero_optimization": {
            "stage": 3,
            "overlap_comm": False,
            "contiguous_gradients": True,
            "sub_group_size": 1_000_000_000,
            "reduce_bucket_size": "auto",
            "stage3_prefetch_bucket_size": "auto",
            "stage3_param_persistence_threshold": "auto",
            "stage3_max_live_parameters": 1_000_000_000,
            "stage3_max_reuse_distance": 1_000_000_000,
            "stage3_gather_16bit_weights_on_model_save": True,
        },
    }
