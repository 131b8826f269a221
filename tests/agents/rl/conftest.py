"""Small training runs; everything here needs the extra rl."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from support import one_torch_thread

pytest.importorskip("sb3_contrib", reason="needs the extra rl")


from agents.rl.config import TrainConfig


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


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
