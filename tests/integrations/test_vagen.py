"""VAGEN's methods, on household tasks; the library itself is not needed."""

from __future__ import annotations

import asyncio

from conformance import SETTINGS, Answer, Course, differences, reply

from er_gym.integrations.vagen import PLACE, HouseholdEnv


class OfVAGEN:
    def __init__(self) -> None:
        self.env = HouseholdEnv({"pictures": False, **SETTINGS})

    def reset(self, task_id: str) -> Answer:
        obs, about = asyncio.run(self.env.reset(seed=0, task_id=task_id))
        assert about["task_id"] == task_id
        return Answer(obs["obs_str"], 0.0, False, about["success"])

    def step(self, text: str) -> Answer:
        obs, reward, done, about = asyncio.run(self.env.step(reply(text)))
        assert done or not about["truncated"]
        return Answer(obs["obs_str"], reward, done, about["success"])


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfVAGEN(), courses) == []


def test_pictures_have_their_places_and_seeds_draw_tasks() -> None:
    env = HouseholdEnv({"width": 64, "height": 48})
    assert "<action>" in asyncio.run(env.system_prompt())["obs_str"]
    first, about = asyncio.run(env.reset(seed=1))
    again, same = asyncio.run(env.reset(1))
    assert (first["obs_str"], about) == (again["obs_str"], same)
    (picture,) = first["multi_modal_input"][PLACE]
    assert picture.size == (64, 48)
    assert first["obs_str"].count(PLACE) == 1
    asyncio.run(env.close())
