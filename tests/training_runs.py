"""Directories of training runs as they look while they grow, for tests of pages."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

FINETUNING = {
    "format": "er-gym/finetune/1",
    "model": "base",
    "data": ["data/x"],
    "settings": {"stage": "imitation", "training": {"epochs": 4.0}},
}


def metric(update: int, loss: float) -> str:
    line = {"update": update, "epoch": update / 100, "loss": loss, "learning_rate": 1e-3,
            "gradient_norm": 0.5, "tokens_per_second": 900.0, "memory": 2**30}  # fmt: skip
    return json.dumps(line) + "\n"


def make_finetuning(folder: Path) -> Path:
    folder.mkdir(parents=True)
    (folder / "finetune.json").write_text(json.dumps(FINETUNING))
    (folder / "metrics.jsonl").write_text(metric(10, 5.0) + metric(100, 0.5))
    return folder


def make_policy(folder: Path) -> Path:
    folder.mkdir()
    (folder / "config.yaml").write_text(
        "algorithm:\n  name: ppo\ntotal_steps: 4000\nenv:\n  types: [single_search]\n"
    )
    lines: list[dict[str, Any]] = [
        {"steps": 1000, "seconds": 3.0, "rollout/success_rate": 0.25, "rollout/ep_rew_mean": 1.5,
         "success/single_search": 0.25},
        {"steps": 2000, "seconds": 6.0, "eval/success_rate": 0.5, "eval/mean_reward": 2.0},
    ]  # fmt: skip
    (folder / "curve.jsonl").write_text("".join(json.dumps(each) + "\n" for each in lines))
    return folder
