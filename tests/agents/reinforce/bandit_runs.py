"""Runs whose reward is that of :mod:`bandit`: their settings, and what two runs must share."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agents.finetune.run_files import RunFiles
from agents.reinforce.settings import ReinforceSettings

_TIMES = ("seconds", "seconds_playing", "seconds_learning", "memory")
_SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "rewards": {"bandit:even_letters": 1.0},
    "model": {"dtype": "float32"},
    "play": {"tasks": 1, "concurrency": 1},
    "advantage": {"row": "gigpo", "discount": 0.0},
    "training": {"learning_rate": 0.03, "save_every": 2},
}
"""One conversation at a time: then the same numbers are added in the same order."""


def bandit_settings(*more: Mapping[str, Mapping[str, Any]]) -> ReinforceSettings:
    """The settings, with those of each of ``more`` in place of what stood before."""
    told = dict(_SETTINGS)
    for each in more:
        told |= {name: {**told.get(name, {}), **values} for name, values in each.items()}
    return ReinforceSettings.model_validate(told)


def curve(run: Path) -> list[dict[str, Any]]:
    """What a run logs for each update, but for times and memory."""
    lines = RunFiles(run).metrics()
    return [{key: line[key] for key in line if key not in _TIMES} for line in lines]
