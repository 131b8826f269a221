"""The directory of a reinforcement run.

::

    RUN/reinforce.json                 what learns on which tasks, with which settings
    RUN/checkpoints/checkpoint-20/     all that is needed to continue; only whole ones are here
    RUN/metrics.jsonl                  the figures of each update, a line each
    RUN/episodes.jsonl                 what each episode earned, a line each
    RUN/logs/                          the figures for TensorBoard
    RUN/model/                         the result; it is there when the run is finished

It is kept as that of a fine-tuning run (:mod:`agents.finetune.run_files`).
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Literal

import safetensors.torch
import torch
from pydantic import BaseModel, ConfigDict

from agents.finetune.model_files import History
from agents.finetune.run_files import (
    CHECKPOINTS,
    LOGS,
    METRICS,
    RunFiles,
    lines_of,
    replaced_folder,
)
from agents.vlm.tuned_model import REINFORCED as MANIFEST
from er_gym.resumable import FolderKind
from er_gym.tasks.reading import read_bytes
from er_gym.writing import write_atomic

EPISODES = "episodes.jsonl"
_TRAINED, _BEST = "trained.safetensors", "best.safetensors"
_OPTIMIZER, _STATE = "optimizer.pt", "state.json"


class ReinforceManifest(BaseModel):
    """What learns on which tasks. Two commands with equal manifests may share a directory.

    Attributes:
        format: the version of this layout.
        settings: of the run.
        model: the directory of the model at the start; ``model_digest``: of its files.
        suite: the name of the suite; ``suite_digest``: of its tasks.
        history: what the model had been through before.
        er_gym: the version of the package.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/reinforce/1"] = "er-gym/reinforce/1"
    settings: dict[str, Any]
    model: str
    model_digest: str
    suite: str
    suite_digest: str
    history: History = History()
    er_gym: str


class State(BaseModel):
    """How far a run is, beside its weights.

    Attributes:
        update: how many are done.
        success: the model's by type of task, a fraction.
        episodes, tokens: how many have been played, and learnt from.
        continued: how often episodes were continued from one of their states.
        seconds: that it has taken.
        best: the greatest success in validation, a fraction; None before the first.
        best_update: after which update that was.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    update: int = 0
    success: dict[str, float] = {}
    episodes: int = 0
    continued: int = 0
    tokens: int = 0
    seconds: float = 0.0
    best: float | None = None
    best_update: int = 0


class Checkpoint(BaseModel):
    """What a checkpoint holds.

    Attributes:
        state: how far the run is.
        trained: the weights that learn, by name.
        optimizer: the optimizer's state.
        best: the weights that did best in validation; empty if none are kept.
    """

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    state: State
    trained: dict[str, torch.Tensor]
    optimizer: dict[str, Any]
    best: dict[str, torch.Tensor] = {}

    def write(self, run: RunFiles, keep: int) -> None:
        """Write it whole or not at all; older ones but ``keep - 1`` are removed."""
        with replaced_folder(run.checkpoints / f"checkpoint-{self.state.update}") as folder:
            safetensors.torch.save_file(self.trained, folder / _TRAINED)
            if self.best:
                safetensors.torch.save_file(self.best, folder / _BEST)
            torch.save(self.optimizer, folder / _OPTIMIZER)
            write_atomic(folder / _STATE, self.state.model_dump_json(indent=2) + "\n")
        run.prune(keep)

    @staticmethod
    def read(folder: Path) -> Checkpoint:
        """Read one."""
        best = folder / _BEST
        return Checkpoint(
            state=State.model_validate_json(read_bytes(folder / _STATE)),
            trained=safetensors.torch.load_file(folder / _TRAINED),
            optimizer=torch.load(folder / _OPTIMIZER, weights_only=True),
            best=safetensors.torch.load_file(best) if best.is_file() else {},
        )


def append_lines(file: Path, lines: Iterable[Mapping[str, Any]]) -> None:
    """Append objects to a log."""
    text = "".join(json.dumps(line) + "\n" for line in lines)
    with file.open("a", encoding="utf-8") as log:
        log.write(text)


def rewind(run: RunFiles, update: int) -> None:
    """Remove what was logged after an update, and a half-written line."""
    run.rewind_metrics(update)
    file = run.path / EPISODES
    if file.exists():
        kept = [line for line in lines_of(file) if line["update"] <= update]
        write_atomic(file, "".join(json.dumps(line) + "\n" for line in kept))


REINFORCING = FolderKind(
    noun="reinforcement run",
    command="er-gym reinforce",
    manifest=MANIFEST,
    model=ReinforceManifest,
    parts=(CHECKPOINTS, LOGS, METRICS, EPISODES),
    holds_something=lambda path: RunFiles(path).finished or bool(RunFiles(path).last_checkpoint()),
)
