"""Hand-made episodes, so that every expected number can be worked out on paper."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from er_gym.rollout.records import EpisodeRecord, KeyActionRecord, StepRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory

Episode = Callable[..., EpisodeRecord]


def make_step(text: str, interactable: tuple[str, ...] = ()) -> StepRecord:
    """``"pickup Egg"`` succeeded, ``"!pickup Egg"`` failed."""
    success, text = not text.startswith("!"), text.removeprefix("!")
    words = text.split()
    object_type = words.pop() if words[-1][0].isupper() else ""
    return StepRecord(
        verb=" ".join(words),
        object_type=object_type,
        success=success,
        interactable=list(interactable),
        feedback=f"you did: {text}" if success else f"you cannot: {text}",
        text=text,
    )


def make_key(text: str) -> KeyActionRecord:
    """``"pickup Egg"``, or with its own id: ``"pickup Potato = Egg|+00.00|+01.00|+02.00"``."""
    action, _, object_id = text.partition(" = ")
    step = make_step(action)
    if not object_id and step.object_type:
        object_id = f"{step.object_type}|+00.00|+01.00|+02.00"
    return KeyActionRecord(verb=step.verb, object_type=step.object_type, object_id=object_id)


def make_episode(
    keys: tuple[str, ...],
    steps: tuple[str | StepRecord, ...],
    *,
    task_type: str = "pickup_and_put",
    name: str = "put the Egg in the Bowl",
    task_id: str = "task-1",
    max_steps: int = 30,
    end_reason: str = "end",
    search_targets: list[str] | None = None,
    error: str = "",
) -> EpisodeRecord:
    """An episode whose first step, ``init``, is added."""
    played = [make_step(step) if isinstance(step, str) else step for step in ("init", *steps)]
    return EpisodeRecord(
        task_id=task_id,
        task_type=task_type,
        scene="FloorPlan1",
        instruction=name,
        name=name,
        key_actions=[make_key(key) for key in keys],
        max_steps=max_steps,
        agent="oracle",
        seed=7,
        steps=played,
        success=False,
        end_reason=end_reason,
        search_targets=search_targets,
        total_reward=0.0,
        seconds=0.5,
        error=error,
    )


@pytest.fixture
def episode() -> Episode:
    return make_episode


@pytest.fixture
def step() -> Callable[..., StepRecord]:
    return make_step


@pytest.fixture
def manifest() -> Manifest:
    return Manifest(
        suite="hand-made",
        suite_digest="abc",
        suite_size=2,
        agent="oracle",
        env={"backend": "embedded", "obs_mode": "text"},
        seed=0,
        er_gym="0.1.0",
    )


@pytest.fixture
def run_directory(tmp_path: Path, manifest: Manifest) -> RunDirectory:
    return RunDirectory.create(tmp_path / "run", manifest)


COUNTER = "CounterTop|-00.08|+01.15|00.00"
ON_IT = (
    "Apple|-00.47|+01.15|+00.48",
    "Book|+00.15|+01.10|+00.62",
    "Bowl|+00.27|+01.10|-00.75",
    "Bread|-00.52|+01.17|-00.03",
    "ButterKnife|-00.41|+01.11|-00.46",
    "CreditCard|-00.46|+01.10|+00.87",
    "Tomato|-00.39|+01.14|-00.81",
)
"""In FloorPlan1."""


def make_paper_task(identity: int, object_id: str) -> dict[str, Any]:
    """To pick up something from the counter of FloorPlan1, in the paper's format."""
    kind = object_id.split("|")[0]

    def action(verb: str, done_to: str) -> dict[str, Any]:
        return {
            "action": verb,
            "objectId": done_to,
            "objectType": done_to.split("|")[0],
            "relatedObject": [COUNTER, object_id] if done_to else [],
        }

    return {
        "scene": "FloorPlan1",
        "tasktype": "single_pickup",
        "taskname": f"Take the {kind}.",
        "task_metadata": {
            "actions": [
                action("navigate to", COUNTER),
                action("pickup", object_id),
                action("end", ""),
            ]
        },
        "identity": identity,
        "target_objects": [object_id],
        "related_objects": [COUNTER],
        "navigable_objects": ["CounterTop"],
    }


@pytest.fixture
def paper_tasks() -> list[dict[str, Any]]:
    """Seven tasks, ``paper-0`` to ``paper-6``."""
    return [make_paper_task(number, object_id) for number, object_id in enumerate(ON_IT)]


@pytest.fixture
def tasks_file(tmp_path: Path, paper_tasks: list[dict[str, Any]]) -> Path:
    path = tmp_path / "tasks.json"
    path.write_text(json.dumps(paper_tasks))
    return path
