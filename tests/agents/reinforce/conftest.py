"""Tiny models with random weights, and how they converse."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

sys.path.append(str(Path(__file__).parent))  # for the helpers beside it
sys.path.append(str(Path(__file__).parents[1] / "vlm"))  # for tiny_qwen

pytest.importorskip("torch", reason="needs the extra finetune")
pytest.importorskip("transformers", reason="needs the extra finetune")
pytest.importorskip("peft", reason="needs the extra finetune")
pytest.importorskip("tensorboard", reason="needs the extra finetune")

from support import one_torch_thread
from tiny_qwen import make_tiny_qwen

from er_gym.tasks.splits import EVALUATION_SCENES
from er_gym.tasks.suites import Suite, load_suite


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """It reads, and says a letter at a time."""
    agent = {"sees": "text", "prompts": {"dialect": "text"}}
    return _model(tmp_path_factory.mktemp("reads"), "qwen2", agent)


@pytest.fixture(scope="session")
def seeing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """It sees small pictures, and says a letter at a time."""
    pictures = {"width": 60, "height": 60, "model_min_pixels": 6_000}
    agent = {"prompts": {"dialect": "sight"}, "pictures": pictures}
    return _model(tmp_path_factory.mktemp("sees"), "qwen2_5_vl", agent)


def _model(folder: Path, family: str, agent: dict[str, Any]) -> Path:
    made = make_tiny_qwen(folder / "model", family=family)
    told = json.loads((made / "generation_config.json").read_text()) | {"repetition_penalty": 1.0}
    (made / "generation_config.json").write_text(json.dumps(told))
    (made / "agent.yaml").write_text(yaml.safe_dump({**agent, "sampling": {"max_tokens": 1}}))
    return made


@pytest.fixture(scope="session")
def suite() -> Suite:
    """Two tasks in bathrooms, where there is little to tell; no test task plays there."""
    whole = load_suite("mini")
    tasks = [task for task in whole.tasks if task.scene in ("FloorPlan410", "FloorPlan411")]
    assert not {task.scene for task in tasks} & {*EVALUATION_SCENES}
    return Suite("two", tuple(tasks[:2]), "digest", whole.env)
