"""What turns earn, and which tasks are played."""

from __future__ import annotations

from collections import Counter

import pytest

from agents.reinforce.curriculum import chosen_tasks, with_results
from agents.reinforce.rewards import rewards_of
from agents.reinforce.settings import CurriculumSettings
from er_gym.plugins import PluginError
from er_gym.rollout.records import EpisodeRecord, KeyActionRecord, StepRecord
from er_gym.tasks.suites import load_suite


def step(verb: str, type_: str = "", *, success: bool = True, reward: float = 0.0, thought="x"):  # type: ignore[no-untyped-def]
    return StepRecord(verb=verb, object_type=type_, success=success, reward=reward, thought=thought)


RECORD = EpisodeRecord(
    task_id="t", task_type="single_search", scene="FloorPlan1", instruction="?", name="?",
    key_actions=[KeyActionRecord(verb="open"), KeyActionRecord(verb="end")],
    max_steps=10, agent="a", seed=0, success=True, end_reason="end", total_reward=2.0, seconds=0.0,
    steps=[
        step("init"),
        step("move forward"),
        step("move forward"),
        step("open", "Fridge", reward=1.0),
        step("open", "Fridge", success=False, thought=" "),
        step("error", success=False),
        step("end", reward=1.0),
        StepRecord(verb="end", success=True, appended=True),
    ],
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "earned"),
    [
        ("success", [0, 0, 0, 0, 0, 1]),
        ("key_actions", [0, 0, 0.5, 0, 0, 0.5]),
        ("illegal", [0, 0, 0, -1, 0, 0]),
        ("unreadable", [0, 0, 0, 0, -1, 0]),
        ("repeated", [0, 0, 0, -1, 0, 0]),
        ("false_end", [0] * 6),
        ("thoughtless", [0, 0, 0, -1, 0, 0]),
        ("turns", [-0.1] * 6),
    ],
)
def test_each_reward_is_earned_by_its_turns(name: str, earned: list[float]) -> None:
    assert rewards_of(RECORD, {name: 1.0})[name] == pytest.approx(earned)
    assert rewards_of(RECORD, {name: 0.5})[name] == pytest.approx([each / 2 for each in earned])


def test_ending_is_false_where_the_task_is_not_done() -> None:
    failed = RECORD.model_copy(update={"success": False})
    assert rewards_of(failed, {"false_end": 1.0})["false_end"] == [0, 0, 0, 0, 0, -1]
    cut = failed.model_copy(update={"steps": failed.steps[:-2]})  # the steps ran out
    assert rewards_of(cut, {"false_end": 1.0})["false_end"] == [0] * 5


def test_a_reward_must_be_known() -> None:
    with pytest.raises(PluginError, match="thoughtless"):
        rewards_of(RECORD, {"sucess": 1.0})


def test_types_that_sometimes_succeed_are_played_most() -> None:
    tasks = load_suite("mini").tasks
    names = sorted({task.type.name for task in tasks})
    success = dict.fromkeys(names, 1.0) | {names[0]: 0.5, names[1]: 0.0}
    counted: Counter[str] = Counter()
    for seed in range(30):
        chosen = chosen_tasks(tasks, success, 6, CurriculumSettings(floor=0.001), (seed,))
        assert len({task.id for task in chosen}) == 6
        counted.update(task.type.name for task in chosen)
    assert counted[names[0]] > 150
    even = chosen_tasks(tasks, success, len(tasks) + 5, CurriculumSettings(), (0,))
    assert len(even) == len(tasks)


def test_success_is_remembered() -> None:
    found = with_results({"a": 0.5, "b": 1.0}, [("a", True), ("a", True), ("c", False)], 0.8)
    assert found == pytest.approx({"a": 0.6, "b": 1.0, "c": 0.0})
