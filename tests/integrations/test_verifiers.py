"""verifiers' environment plays household tasks."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from conformance import SETTINGS, Course, reply

vf = pytest.importorskip("verifiers.v1", reason="needs pip install 'er-gym[verifiers]'")
plug = pytest.importorskip("er_gym.integrations.verifiers")
MODULE = """\
from er_gym.integrations.verifiers import HouseholdEnv, HouseholdTaskset
__all__ = ["HouseholdEnv", "HouseholdTaskset"]
"""


class Player:
    """Says the texts of a course; then the rollout is cut."""

    def __init__(self, texts: tuple[str, ...]) -> None:
        self.left, self.told = list(texts), []
        self.numbers: dict[str, float] = {}
        self.trace = SimpleNamespace(
            record_reward=self.numbers.__setitem__, record_metric=self.numbers.__setitem__
        )

    @asynccontextmanager
    async def interaction(self, task: Any) -> AsyncIterator[Player]:
        yield self

    async def turn(self, message: Any) -> Any:
        self.told.append(message)
        if not self.left:
            return vf.Segment(messages=[], terminated=True)
        return vf.Segment(messages=[vf.AssistantMessage(content=reply(self.left.pop(0)))])


@pytest.fixture
def household(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    (tmp_path / "er_gym_house.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)

    def made(**taskset: Any) -> Any:
        config = {"taskset": {"id": "er-gym-house", **taskset}}
        return vf.load_environment(plug.HouseholdEnvConfig.model_validate(config))

    return made


def test_it_answers_as_gymnasium_make(household: Any, courses: tuple[Course, ...]) -> None:
    env = household(suite=SETTINGS["episode_source"], settings={"max_steps": SETTINGS["max_steps"]})
    assert isinstance(env, plug.HouseholdEnv)
    tasks = {task.data.id: task for task in env.taskset}
    for course in courses:
        player = Player(course.texts)
        asyncio.run(env.run(tasks[course.task_id], SimpleNamespace(player=player)))
        last = course.answers[-1]
        read = course.answers[:-1] if last.done else course.answers
        assert player.told == [each.text for each in read]
        assert player.numbers["episode_reward"] == sum(each.reward for each in course.answers)
        assert player.numbers["success"] == last.success


def test_tasks_and_pictures(household: Any) -> None:
    env = household(pictures=True, settings={"width": 64, "height": 48})
    task = next(iter(env.taskset.take(1)))
    assert task.key == task.data.id
    assert "<action>" in task.data.system_prompt
    player = Player(("end",))
    asyncio.run(env.run(task, SimpleNamespace(player=player)))
    ((message,),) = player.told
    picture, text = message["content"]
    assert picture["image_url"]["url"].startswith("data:image/png;base64,")
    assert text["text"].startswith("Task: ")
