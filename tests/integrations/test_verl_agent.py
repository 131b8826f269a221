"""verl-agent's environment manager, on household tasks; the library itself is not needed."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
from conformance import SETTINGS, Answer, Course, differences, reply

from er_gym.integrations.verl_agent import IMAGE, HouseholdManager, make_envs


class OfManager:
    def __init__(self) -> None:
        self.rooms = HouseholdManager(1, **SETTINGS)

    def reset(self, task_id: str) -> Answer:
        seen, (about,) = self.rooms.reset([{"task_id": task_id}])
        assert seen["text"][0].endswith(about["text"])
        assert seen["image"] is None
        return Answer(about["text"], 0.0, False, about["won"])

    def step(self, text: str) -> Answer:
        seen, rewards, dones, (about,) = self.rooms.step([reply(text)])
        assert seen["text"][0].endswith(about["text"])
        return Answer(about["text"], float(rewards[0]), bool(dones[0]), about["won"])


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfManager(), courses) == []


def test_a_group_plays_one_task_and_is_grouped_by_anchor() -> None:
    rooms = HouseholdManager(2, 2, seed=3, history=1, pictures=True, width=64, height=48)
    seen, infos = rooms.reset()
    tasks = [about["task_id"] for about in infos]
    assert tasks[0] == tasks[1] != tasks[2] == tasks[3]
    assert seen["image"].shape == (4, 48, 64, 3)
    assert all(text.count(IMAGE) == 1 for text in seen["text"])
    assert len(set(seen["anchor"])) == 2

    replies = ["<action>observe</action>", "<action>end</action>", "sing", "<action>end</action>"]
    seen, rewards, dones, infos = rooms.step(replies)
    assert dones.tolist() == [False, True, False, True]
    valid = [about["is_action_valid"].item() for about in infos]
    assert valid == [True, True, False, True]
    assert "observe: Step 2 of" in seen["text"][0]
    assert seen["anchor"][2].startswith(tasks[2])

    _, rewards, dones, again = rooms.step(["<action>end</action>"] * 4)  # in all, as it does
    assert dones.all()
    assert rewards[[1, 3]].tolist() == [0.0, 0.0]
    assert [about["won"] for about in again][1::2] == [about["won"] for about in infos][1::2]
    batches = [[{"active_masks": True}, {"active_masks": place % 2 == 0}] for place in range(4)]
    won = rooms.success_evaluator(
        total_infos=[[*pair] for pair in zip(infos, again, strict=True)], total_batch_list=batches
    )
    assert np.array_equal(won["success_rate"], [float(about["won"]) for about in again])
    assert rooms.reset()[1][0]["task_id"] != tasks[0]
    rooms.close()


def test_rooms_by_verl_agents_configuration() -> None:
    class Settings(dict):  # as OmegaConf: both attributes and get
        __getattr__ = dict.__getitem__

    config = SimpleNamespace(
        data=SimpleNamespace(train_batch_size=2, val_batch_size=3),
        env=Settings(
            rollout=SimpleNamespace(n=2), er_gym={"scaffold": "shaping"}, er_gym_val={"seed": 5}
        ),
    )
    train, val = make_envs(config)
    assert [len(each.reset()[1]) for each in (train, val)] == [4, 3]
    assert train.reset()[0]["text"][0] != val.reset()[0]["text"][0]
    train.close()
    val.close()
