"""ms-swift's gym scheduler plays household tasks."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from conformance import SETTINGS, Answer, Course, differences, reply

from er_gym.tasks.suites import load_suite

gym_env = pytest.importorskip("swift.rollout.gym_env", reason="needs ms-swift")
plug = pytest.importorskip("er_gym.integrations.ms_swift")


class OfSwift:
    def reset(self, task_id: str) -> Answer:
        config = {"name": plug.NAME, "task_id": task_id, "prompt": None, **SETTINGS}
        self.env = gym_env.envs[plug.NAME](config)
        text, about, system = asyncio.run(self.env.reset(None))
        assert about == {"task_id": task_id}
        assert "navigate to" in system
        return Answer(text, 0.0, False, False)

    def step(self, text: str) -> Answer:
        said = {"role": "assistant", "content": reply(text)}
        text, reward, done, about = asyncio.run(self.env.step([said]))
        return Answer(text, reward, done, about["success"])


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfSwift(), courses) == []


def test_its_scheduler_plays_an_episode(courses: tuple[Course, ...]) -> None:
    multi_turn = pytest.importorskip("swift.rollout.multi_turn")
    course = next(each for each in courses if each.answers[-1].success)
    task = next(each for each in load_suite("er-1k").tasks if each.id == course.task_id)
    (row,) = plug.rows([task], **SETTINGS)
    scheduler = multi_turn.GYMScheduler(max_turns=50, gym_env=plug.NAME)

    class Request:
        uuid, data_dict, messages = "one", row, row["messages"]

    request: Any = Request()

    async def played() -> list[dict[str, Any]]:
        await scheduler.on_trajectory_start([request])
        told = []
        for text in course.texts:
            request.messages.append({"role": "assistant", "content": reply(text)})
            told.append(await scheduler.on_turn_end(request, None, len(told)))
            scheduler.step(request, None, len(told))
        return told

    told = asyncio.run(played())
    assert [each["done"] for each in told] == [each.done for each in course.answers[1:]]
    rewards = [each.reward for each in course.answers[1:]]
    assert told[-1]["rollout_infos"]["step_rewards"] == rewards
    users = [each["content"] for each in request.messages if each["role"] == "user"]
    assert users == [each.text for each in course.answers[:-1]]
