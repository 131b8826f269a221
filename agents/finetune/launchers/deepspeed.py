"""DeepSpeed: er-gym's own trainer on several GPUs; its settings, ZeRO-3, and the data as it is."""

from __future__ import annotations

import json
import shutil
from functools import partial
from itertools import chain
from pathlib import Path

from agents import configs
from agents.finetune.launchers.plan import (
    DATA,
    OUTPUT,
    ZERO3_FILE,
    LauncherFiles,
    LaunchPlan,
    Program,
    zero3,
)
from agents.finetune.launchers.sources import SourceJob
from er_gym.data.collection import MANIFEST
from er_gym.data.exports.ms_swift import MS_SWIFT as EXPORT
from er_gym.writing import place_file

NAME = "deepspeed"
_SETTINGS, _MODEL = "finetune.yaml", "model"
_LAUNCH = ("torchrun", "--nproc_per_node")
_MODULE = ("-m", "benchmarks.cli", "finetune")


def _write(plan: LaunchPlan, folder: Path) -> LauncherFiles:
    whole = (plan.source.path / MANIFEST).is_file()
    if whole:
        shutil.copytree(
            plan.source.path, folder / DATA, copy_function=partial(_placed, copy=plan.copy)
        )
    else:  # messages with a flag for each turn, which er-gym reads
        EXPORT.write(SourceJob.of(plan.source, folder / DATA, per_turn=False, copy=plan.copy))
    training = plan.settings.training.model_copy(update={"deepspeed": ZERO3_FILE})
    settings = plan.settings.model_copy(update={"training": training})
    hub = plan.model.weights == plan.model.facts.hub
    arguments = {
        "--config": _SETTINGS,
        "--model": _MODEL if hub else plan.model.weights,
        "--data": DATA if whole else f"{DATA}/train.jsonl",
        "--out": OUTPUT,
    }
    notes = ["This is er-gym's own trainer: the cluster needs `er-gym[finetune]` and deepspeed."]
    if hub:
        notes.append(
            f"It loads a model from a directory: `hf download {plan.model.weights} --local-dir "
            f"{_MODEL}` first."
        )
    return LauncherFiles(
        texts={
            _SETTINGS: configs.dump(settings),
            ZERO3_FILE: json.dumps(zero3(plan), indent=2) + "\n",
        },
        command=(*_LAUNCH, str(plan.gpus), *_MODULE, *chain(*arguments.items())),
        environment={},
        notes=tuple(notes),
        made_with="DeepSpeed's ZeRO-3 through transformers",
    )


def _placed(source: str, to: str, *, copy: bool) -> str:
    place_file(Path(source), Path(to), copy=copy)
    return to


DEEPSPEED = Program(NAME, _write)
