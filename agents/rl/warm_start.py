"""What happens before reinforcement learning: cloning, then rounds of DAgger."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from sb3_contrib import MaskablePPO

from agents.rl.cloning import clone_behaviour, collect_demonstrations
from agents.rl.config import TrainConfig
from agents.rl.demonstrations import Demonstrations, concatenate
from agents.rl.guidance import Practice, WarmStart
from agents.rl.practice import advised_envs, play_with_advice
from er_gym.writing import write_atomic

WARM_START = "warm_start.json"


def warm_start(
    model: MaskablePPO,
    config: TrainConfig,
    how: WarmStart,
    run: Path,
    seed: int,
    show_progress: bool = False,
) -> None:
    """Clone the teacher, then practise; ``warm_start.json`` in ``run`` holds the results."""
    told: dict[str, Any] = {}
    for told in _stages(model, config, how, seed):
        write_atomic(run / WARM_START, json.dumps(told))
        if show_progress:
            latest = told["rounds"][-1] if told.get("rounds") else told
            print("warm start:", _line(latest), file=sys.stderr)
    if told["refused"] or told["unread"]:
        played = told["steps"] + told["refused"] + told["unread"]
        warnings.warn(
            f"cloning {how.teacher}: of {played:,} steps, {told['refused']:,} "
            f"illegal ones and {told['unread']:,} whose text names no action are left out",
            stacklevel=2,
        )


def _line(told: dict[str, Any]) -> str:
    return ", ".join(
        f"{name.replace('_', ' ')} {value:.3f}" if isinstance(value, float) else f"{name} {value:,}"
        for name, value in told.items()
    )


def _stages(
    model: MaskablePPO, config: TrainConfig, how: WarmStart, seed: int
) -> Iterator[dict[str, Any]]:
    """After each stage, what is known about the warm start."""
    rates = _rates(how)
    gathered = collect_demonstrations(config, how, seed)
    agreement = clone_behaviour(model, gathered, how, seed, rates[: how.epochs])
    told: dict[str, Any] = {
        "teacher_success": gathered.successes / gathered.episodes,
        "steps": len(gathered),
        "refused": gathered.refused,
        "unread": gathered.unread,
        "agreement": agreement,
    }
    yield told
    if how.practice is not None:
        told["rounds"] = []
        for each in _rounds(model, config, how, how.practice, gathered, seed, rates):
            told["rounds"].append(each)
            yield told


def _rounds(
    model: MaskablePPO,
    config: TrainConfig,
    how: WarmStart,
    practice: Practice,
    gathered: Demonstrations,
    seed: int,
    rates: list[float],
) -> Iterator[dict[str, Any]]:
    env = advised_envs(config, seed)
    try:
        for number in range(practice.rounds):
            new = play_with_advice(model, env, practice, config.algorithm.gamma)
            gathered = concatenate([gathered, new])
            begin = how.epochs + number * practice.epochs
            order = int(np.random.SeedSequence([seed, number + 1]).generate_state(1)[0])
            agreement = clone_behaviour(
                model, gathered, how, order, rates[begin : begin + practice.epochs]
            )
            yield {
                "success": new.successes / max(1, new.episodes),
                "episodes": new.episodes,
                "steps": len(gathered),
                "refused": new.refused,
                "agreement": agreement,
            }
    finally:
        env.close()


def _rates(how: WarmStart) -> list[float]:
    """The learning rates of all epochs, falling in a line."""
    epochs = how.epochs + (how.practice.rounds * how.practice.epochs if how.practice else 0)
    falls = np.linspace(1.0, how.final_learning_rate, epochs)
    return [how.learning_rate * float(share) for share in falls]
