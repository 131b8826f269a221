"""SkyRL-gym plays household tasks."""

from __future__ import annotations

from typing import Any

import pytest
from conformance import SETTINGS, Answer, Course, differences, reply

from er_gym.tasks.suites import load_suite

skyrl_gym = pytest.importorskip("skyrl_gym", reason="needs pip install 'er-gym[skyrl-gym]'")
plug = pytest.importorskip("er_gym.integrations.skyrl_gym")


def made(task_id: str, **extras: Any) -> Any:
    plug.register()
    return skyrl_gym.make(
        plug.NAME, env_config=SETTINGS, extras={"task_id": task_id, "max_turns": 50, **extras}
    )


class OfSkyRL:
    def reset(self, task_id: str) -> Answer:
        self.env = made(task_id)
        (prompt, observation), about = self.env.init([{"role": "system", "content": "Play."}])
        assert prompt == {"role": "system", "content": "Play."}
        assert (observation["role"], about) == ("user", {"task_id": task_id})
        return Answer(observation["content"], 0.0, False, False)

    def step(self, text: str) -> Answer:
        told = self.env.step(reply(text))
        about, done = told["metadata"], told["done"]
        assert [each["content"] for each in told["observations"]] == [about["text"]] * (not done)
        return Answer(about["text"], told["reward"], done, about["success"])


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfSkyRL(), courses) == []


def test_turns_and_numbers_of_an_episode(courses: tuple[Course, ...]) -> None:
    course = max(courses, key=lambda each: len(each.texts))
    env = made(course.task_id, max_turns=3)
    env.init([])
    done = [env.step(reply(text))["done"] for text in course.texts[:3]]
    assert done == [False, False, True]
    numbers = env.get_metrics()
    assert numbers["episode_reward"] == sum(each.reward for each in course.answers[1:4])
    assert (numbers["success"], numbers["steps"]) == (0.0, 4)
    env.close()


def test_rows_and_pictures() -> None:
    task = load_suite("mini").tasks[0]
    (row,) = plug.rows([task])
    assert (row["env_class"], row["task_id"]) == (plug.NAME, task.id)
    env = plug.HouseholdEnv({"pictures": True, "width": 64, "height": 48}, row)
    messages, _ = env.init(row["prompt"])
    picture, text = messages[-1]["content"]
    assert picture["image_url"]["url"].startswith("data:image/png;base64,iVBOR")
    assert task.instruction in text["text"]
    env.close()
