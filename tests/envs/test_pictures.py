"""Pictures in observations: names in them, in other processes, on video."""

from __future__ import annotations

from pathlib import Path

import gymnasium
import pytest

from er_gym import EmbodiedEnv


def test_names_are_written_into_the_picture_and_change_nothing_else() -> None:
    plain, named = (
        EmbodiedEnv(obs_mode="rgb+state", width=200, height=150, annotate=annotate)
        for annotate in (False, True)
    )
    for env_seed in range(2):
        one, other = (env.reset(seed=env_seed)[0] for env in (plain, named))
        assert (one["state"] == other["state"]).all()
        changed = (one["rgb"] != other["rgb"]).any(axis=2)
        assert 0.005 < changed.mean() < 0.9
    for env in (plain, named):
        env.close()


def test_an_observe_with_names_names_things_in_its_views() -> None:
    env = EmbodiedEnv(obs_mode="rgb", width=200, height=150, annotate=True)
    env.reset(seed=1)
    env.step("observe")
    assert all(view.shape == (150, 200, 3) for view in env.details["views"].values())
    env.close()


def test_processes_draw_the_same_pictures() -> None:
    arguments = {"obs_mode": "rgb", "width": 96, "height": 64}
    vector = gymnasium.make_vec(
        "ER-SingleSearch-v0", num_envs=2, vectorization_mode="async", **arguments
    )
    one = gymnasium.make("ER-SingleSearch-v0", **arguments)
    many, _ = vector.reset(seed=[5, 6])
    for k, seed in enumerate((5, 6)):
        assert (many["rgb"][k] == one.reset(seed=seed)[0]["rgb"]).all()
    vector.close()
    one.close()


def test_episodes_can_be_recorded(tmp_path: Path) -> None:
    pytest.importorskip("moviepy", reason="RecordVideo needs moviepy")
    env = gymnasium.wrappers.RecordVideo(
        gymnasium.make("ER-SinglePickup-v0", obs_mode="state", render_mode="rgb_array"),
        str(tmp_path),
        disable_logger=True,
    )
    env.reset(seed=0)
    for _ in range(3):
        env.step(0)  # "observe"; a random action may be "end"
    env.close()
    assert [file.suffix for file in tmp_path.iterdir()] == [".mp4"]
