"""Small training runs; everything here needs the extra rl."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("sb3_contrib", reason="needs the extra rl")

import torch

from agents.rl.config import TrainConfig


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    """Torch's threads would wait for each other where tests share cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def small(**changes: Any) -> TrainConfig:
    """A run of seconds, in the rooms of the bundled suite."""
    settings: dict[str, Any] = {
        "total_steps": 512,
        "threads": 1,
        "env": {"episodes": "mini", "types": ["single_pickup"]},
        "vec": {"envs": 4, "workers": 1},
        "algorithm": {"name": "ppo", "n_steps": 64, "batch_size": 128},
        "network": {"width": 16, "kind": 4},
        "evaluation": None,
        "tensorboard": False,
    }
    return TrainConfig.model_validate({**settings, **changes})


@pytest.fixture(scope="session")
def make_config() -> Any:
    return small
