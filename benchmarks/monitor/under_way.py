"""An episode that is under way, as the event stream tells it: its record so far."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic_core import to_json

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.world import CannotReplay, task_at
from er_gym.rollout.events import EVENTS, StepDone
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import EpisodeRecord, StepRecord, record_episode
from er_gym.rollout.run_directory import Manifest
from er_gym.tasks.verbs import INIT
from er_gym.writing import CAREFULLY

_MOST_BYTES = 16 * 2**20
"""No more of the end of the stream is read: an episode that is under way is told there."""


def record_so_far(path: Path, manifest: Manifest, row: EpisodeRow) -> EpisodeRecord:
    """The record of an episode that is under way, as far as the event stream tells it.

    The stream tells of a step what was done, whether it was, the reward, the thought and the
    feedback, which streams of older versions lack. The key actions are those of the task, where it
    is of a suite of er-gym's.
    """
    steps = [StepRecord(verb=INIT, success=True), *_steps(path / EVENTS, row.key)]
    told: dict[str, Any] = {
        "task_type": row.task_type,
        "scene": row.scene,
        "instruction": row.instruction,
        "max_steps": max(1, row.max_steps),
        "sample": row.sample,
    }
    seed = episode_seed(manifest.seed, row.key)
    try:
        known = record_episode(
            task_at(manifest, row.task_id), agent=manifest.agent, seed=seed, steps=steps
        )
        return known.model_copy(update=told)
    except CannotReplay:
        return EpisodeRecord(
            **told,
            task_id=row.task_id,
            name=row.instruction,
            key_actions=[],
            agent=manifest.agent,
            seed=seed,
            steps=steps,
            success=False,
            end_reason="",
            total_reward=sum(step.reward for step in steps),
            seconds=0.0,
        )


def _steps(stream: Path, key: str) -> list[StepRecord]:
    """The steps of an episode since it began last."""
    found: list[StepRecord] = []
    # Most lines are of other episodes, and are not parsed.
    mark = b'"task_id":' + to_json(key)
    for line in _last_lines(stream):
        if mark not in line:
            continue
        try:
            if b'"kind":"episode_begun"' in line:
                found = []
            elif b'"kind":"step"' in line:
                step = StepDone.model_validate_json(line)
                if step.step == len(found) + 1:
                    told = step.model_dump(include=_TOLD)
                    found.append(StepRecord(**told))
        except ValidationError:
            continue  # half a line, or of a later version
    return found


_TOLD = {"verb", "object_type", "success", "reward", "thought", "feedback"}


def _last_lines(stream: Path) -> list[bytes]:
    try:
        with os.fdopen(os.open(stream, os.O_RDONLY | CAREFULLY), "rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - _MOST_BYTES))
            return file.read().split(b"\n")
    except OSError:
        return []
