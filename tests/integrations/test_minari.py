"""Episodes are recorded as a MinariDataset."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import pytest
from conformance import SETTINGS, Answer, Course, differences

import er_gym
from er_gym.envs.actions import ACTIONS, INDEX, parse

minari = pytest.importorskip("minari", reason="needs pip install 'er-gym[minari]'")
plug = pytest.importorskip("er_gym.integrations.minari")


class OfRecorder:
    def __init__(self) -> None:
        env = er_gym.EmbodiedEnv(obs_mode="text+state", **SETTINGS)
        self.env = plug.Recorder(env)

    def reset(self, task_id: str) -> Answer:
        obs, info = self.env.reset(options={"task": task_id})
        return Answer(obs["text"], 0.0, False, info["success"])

    def step(self, text: str) -> Answer:
        obs, reward, terminated, truncated, info = self.env.step(text)
        return Answer(obs["text"], float(reward), terminated or truncated, info["success"])


def test_it_answers_as_gymnasium_make_and_keeps_what_it_answered(
    courses: tuple[Course, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    recorder = OfRecorder()
    assert differences(recorder, courses) == []
    dataset = recorder.env.create_dataset("er-gym/courses-v0", algorithm_name="by hand")
    kept = [each for each in courses if all(parse(text) is not None for text in each.texts)]
    assert recorder.env.left_out == len(courses) - len(kept) > 0
    assert dataset.total_episodes == len(kept)
    again = minari.load_dataset("er-gym/courses-v0")
    about = list(again.storage.get_episode_metadata(range(len(kept))))
    for course, episode, told in zip(kept, again.iterate_episodes(), about, strict=True):
        assert [ACTIONS[index] for index in episode.actions] == list(map(parse, course.texts))
        assert episode.rewards.tolist() == [each.reward for each in course.answers[1:]]
        assert episode.observations["state"].shape[0] == len(course.texts) + 1
        ended = bool(episode.terminations[-1] or episode.truncations[-1])
        assert ended
        assert (told["task_id"], bool(told["success"])) == (
            course.task_id,
            course.answers[-1].success,
        )
    assert list(again.storage.metadata["actions"]) == [str(action) for action in ACTIONS]


def test_an_environment_by_its_id_is_recovered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = plug.Recorder(gymnasium.make("ER-SingleSearch-v0", obs_mode="state", instances="explore"))
    with pytest.raises(ValueError, match="no episode was recorded"):
        env.create_dataset("er-gym/none-v0")
    first, _ = env.reset(seed=3)
    last, *_ = env.step(INDEX[parse("observe")])
    dataset = env.create_dataset("er-gym/one-v0")
    (episode,) = dataset.iterate_episodes()
    assert np.array_equal(episode.observations["state"], [first["state"], last["state"]])
    assert (episode.terminations.tolist(), episode.truncations.tolist()) == ([False], [True])
    recovered = dataset.recover_environment()
    assert np.array_equal(recovered.reset(seed=3)[0]["state"], first["state"])
    recovered.close()
    env.close()
    with pytest.raises(ValueError, match=r"has no observation 'rgb'; make it with obs_mode='rgb'"):
        plug.Recorder(env, ["rgb"])
