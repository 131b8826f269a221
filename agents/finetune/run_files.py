"""The directory of a fine-tuning run.

::

    RUN/finetune.json                  what is tuned on what, with which settings
    RUN/checkpoints/checkpoint-500/    all that is needed to continue; only whole ones are here
    RUN/metrics.jsonl                  the logged values, a line each
    RUN/logs/                          the same for TensorBoard
    RUN/model/                         the result; it is there when the run is finished

Folders are written beside their place and moved there, so a kill leaves whole ones and drafts,
whose names begin with a dot; drafts are removed when the run goes on.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from agents.finetune.model_files import History
from agents.vlm.tuned_model import MODEL
from agents.vlm.tuned_model import RUN as MANIFEST
from er_gym.resumable import FolderKind
from er_gym.writing import make_folder, write_atomic

CHECKPOINTS, LOGS, METRICS = "checkpoints", "logs", "metrics.jsonl"
_CHECKPOINT = re.compile(r"checkpoint-(\d+)")


class FinetuneManifest(BaseModel):
    """What is tuned on what. Two commands with equal manifests may share a directory.

    Attributes:
        format: the version of this layout.
        settings: of the run.
        model: the directory of the model at the start; ``model_digest``: of its files.
        data: the data's directories; ``data_digest``: of their conversations.
        history: what the model had been through before.
        er_gym: the version of the package.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/finetune/1"] = "er-gym/finetune/1"
    settings: dict[str, Any]
    model: str
    model_digest: str
    data: list[str]
    data_digest: str
    history: History = History()
    er_gym: str


class RunFiles:
    """A run directory.

    Attributes:
        path: the directory.
        checkpoints: the folder of its checkpoints.
        model: where its result will be.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.checkpoints = path / CHECKPOINTS
        self.model = path / MODEL

    @property
    def finished(self) -> bool:
        """Whether the result is there."""
        return self.model.is_dir()

    def last_checkpoint(self) -> Path | None:
        """The newest checkpoint; None if there is none."""
        return max(self._all_checkpoints(), key=_updates, default=None)

    def clear(self) -> None:
        """Make the folder of checkpoints, and remove what a kill left half-written."""
        make_folder(self.checkpoints)
        for folder in (self.path, self.checkpoints):
            for draft in folder.glob(".*.draft"):
                shutil.rmtree(draft)

    def prune(self, keep: int) -> None:
        """Remove all but the newest checkpoints."""
        for old in sorted(self._all_checkpoints(), key=_updates)[:-keep]:
            # Moved first, so that a kill leaves no half of it under its name.
            shutil.rmtree(old.rename(draft_of(old)))

    def rewind_metrics(self, updates: int) -> None:
        """Remove the lines of ``metrics.jsonl`` after an update, and a half-written one."""
        lines = [line for line in self.metrics() if line["update"] <= updates]
        if (self.path / METRICS).exists():
            write_atomic(self.path / METRICS, "".join(json.dumps(each) + "\n" for each in lines))

    def metrics(self) -> list[dict[str, Any]]:
        """The whole lines of ``metrics.jsonl``."""
        return lines_of(self.path / METRICS)

    def _all_checkpoints(self) -> list[Path]:
        return [each for each in self.checkpoints.glob("*") if _CHECKPOINT.fullmatch(each.name)]


def lines_of(file: Path) -> list[dict[str, Any]]:
    """The whole lines of a log; none if it is not there."""
    found = []
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return []
    for line in lines:
        try:
            found.append(json.loads(line))
        except ValueError:  # a kill came while it was written
            continue
    return found


def draft_of(folder: Path) -> Path:
    """Where a folder is written before it is moved to its place."""
    return folder.with_name(f".{folder.name}.draft")


@contextmanager
def replaced_folder(folder: Path) -> Iterator[Path]:
    """Write a folder whole or not at all: fill the folder that this gives."""
    draft = draft_of(folder)
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir(parents=True)
    try:
        yield draft
        move_into_place(draft, folder)
    except BaseException:
        shutil.rmtree(draft, ignore_errors=True)
        raise


def move_into_place(draft: Path, folder: Path) -> None:
    """Move a folder, once its files are on the disk, to where there is none."""
    for file in draft.rglob("*"):
        _sync(file)
    _sync(draft)
    os.rename(draft, folder)
    _sync(folder.parent)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _updates(checkpoint: Path) -> int:
    found = _CHECKPOINT.fullmatch(checkpoint.name)
    return int(found[1]) if found else -1


def _given(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings without those that are None, as a version that did not have them wrote none."""
    return {
        name: _given(value) if isinstance(value, dict) else value
        for name, value in settings.items()
        if value is not None
    }


def _compared(
    there: FinetuneManifest, here: FinetuneManifest
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Settings, model and data; where the content is the same, its path may be another."""
    told = _given(there.settings), _given(here.settings)
    for name in ("model", "data"):
        digest = f"{name}_digest"
        if getattr(there, digest) != getattr(here, digest):
            for each, manifest in zip(told, (there, here), strict=True):
                each |= {f"--{name}": getattr(manifest, name), digest: getattr(manifest, digest)}
    return told


FINETUNING = FolderKind(
    noun="fine-tuning run",
    command="er-gym finetune",
    manifest=MANIFEST,
    model=FinetuneManifest,
    parts=(CHECKPOINTS, LOGS, METRICS),
    holds_something=lambda path: RunFiles(path).finished or bool(RunFiles(path).last_checkpoint()),
    compared=_compared,
)
