"""Minari's own library reads what is written."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import numpy as np
import pytest

pytest.importorskip("minari", reason="needs the extra minari")
pytest.importorskip("h5py", reason="needs the extra minari")

import minari

from er_gym.data.collection import Collection
from er_gym.data.exports import ExportError, ExportOptions, export
from er_gym.envs.actions import ACTIONS, INDEX, parse_action
from er_gym.envs.embodied_env import EmbodiedEnv


def test_episodes_are_those_of_the_trajectories(
    collection: Collection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenes = [each.scene for each in collection.trajectories()]
    summary = export(
        collection, "minari", tmp_path / "out", ExportOptions(held_out=tuple(scenes[:2]))
    )
    assert summary.left_out == {}
    assert summary.samples == {"train": len(scenes) - 2, "validation": 2}
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "out"))
    by_id = {each.id: each for each in collection.trajectories()}
    env = EmbodiedEnv("mini", obs_mode="state")
    for name, count in summary.samples.items():
        dataset = minari.load_dataset(f"er-gym/{name}-v0")
        assert dataset.total_episodes == count
        assert dataset.observation_space == env.observation_space
        assert dataset.action_space == env.action_space
        about = list(dataset.storage.get_episode_metadata(range(count)))
        for episode, told in zip(dataset.iterate_episodes(), about, strict=True):
            was = by_id[told["trajectory"]]
            assert episode.actions.tolist() == [INDEX[turn.action] for turn in was.turns]
            assert episode.rewards.tolist() == [turn.reward for turn in was.turns]
            assert episode.terminations.tolist() == [False] * (was.actions - 1) + [True]
            states = episode.observations["state"]
            assert states.shape == (was.actions + 1, *env.observation_space["state"].shape)
            assert states.dtype == np.float32
            assert len(np.unique(states, axis=0)) > 2
            assert str(told["task"]) == was.task_id
        assert list(dataset.storage.metadata["actions"]) == [str(action) for action in ACTIONS]
    env.close()


def test_an_episode_that_stops_on_the_way_is_cut_off(
    collection: Collection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = next(iter(collection.trajectories()))
    other = Collection.create(tmp_path / "other", collection.manifest)
    (other.path / "parts").symlink_to(collection.path / "parts")
    other.write([first.model_copy(update={"turns": first.turns[:-1]})])
    assert export(other, "minari", tmp_path / "out").samples == {"train": 1}
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "out"))
    (episode,) = minari.load_dataset("er-gym/train-v0").iterate_episodes()
    steps = len(first.turns) - 1
    assert episode.terminations.tolist() == [False] * steps
    assert episode.truncations.tolist() == [False] * (steps - 1) + [True]


def test_what_turns_out_otherwise_is_left_out(collection: Collection, tmp_path: Path) -> None:
    first, second, third, *_ = collection.trajectories()
    other = Collection.create(tmp_path / "other", collection.manifest)
    (other.path / "parts").symlink_to(collection.path / "parts")
    wrong = first.turns[-1].model_copy(update={"reward": 7.0})
    unread = second.turns[0].model_copy(update={"verb": "error", "object_type": ""})
    other.write(
        [
            first.model_copy(update={"turns": [*first.turns[:-1], wrong]}),
            second.model_copy(update={"turns": [unread, *second.turns[1:]]}),
            third.model_copy(update={"id": "gone~a", "task_id": "gone"}),
            third,
        ]
    )
    summary = export(other, "minari", tmp_path / "out")
    assert summary.samples == {"train": 1}
    assert sum(summary.left_out.values()) == 3
    assert len(summary.left_out) == 3


def test_another_suite_is_said(collection: Collection, tmp_path: Path) -> None:
    manifest = collection.manifest.model_copy(update={"suite_digest": "0"})
    other = Collection.create(tmp_path / "other", manifest)
    other.write(collection.trajectories())
    with pytest.raises(ExportError, match=r"are not those that .* was played in"):
        export(other, "minari", tmp_path / "out")


def test_a_relative_folder_and_the_environment_that_minari_makes_again(
    collection: Collection, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    export(collection, "minari", Path("out"))
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "out"))
    dataset = minari.load_dataset("er-gym/train-v0")
    env = dataset.recover_environment()
    assert isinstance(env.unwrapped, EmbodiedEnv)
    (episode,) = dataset.iterate_episodes([0])
    (about,) = dataset.storage.get_episode_metadata([0])
    assert env.observation_space == dataset.observation_space
    obs, _ = env.reset(seed=int(about["seed"]), options={"task": str(about["task"])})
    assert np.array_equal(obs["state"], episode.observations["state"][0])
    obs, *_ = env.step(int(episode.actions[0]))
    assert np.array_equal(obs["state"], episode.observations["state"][1])
    env.close()


def test_minari_collects_in_the_environment_with_its_info(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("jax", reason="Minari's collector needs JAX")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = minari.DataCollector(
        gymnasium.make("ER-SinglePickup-v0", obs_mode="state+text"), record_infos=True
    )
    told = []
    for last in ("end", "open Fridge"):  # Minari cuts the second
        told.append([env.reset(seed=3)[1]])
        for said in ("observe", "navigate to Fridge", last):
            action, _ = parse_action(said)
            told[-1].append(env.step(INDEX[action])[4])
    dataset = env.create_dataset("er-gym/collected-v0", algorithm_name="by hand")
    env.close()
    for episode, infos in zip(minari.load_dataset("er-gym/collected-v0"), told, strict=True):
        assert episode.infos.keys() == infos[0].keys()
        for name, column in episode.infos.items():
            values = [one.decode() if isinstance(one, bytes) else one for one in column]
            assert len(values) == 4
            for value, info in zip(values, infos, strict=True):
                assert np.array_equal(value, info[name]), name
    again = dataset.recover_environment()
    assert isinstance(again.unwrapped, EmbodiedEnv)
    again.close()
