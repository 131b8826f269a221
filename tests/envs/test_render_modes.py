"""``render_mode`` as users of Gymnasium expect it."""

from __future__ import annotations

import copy
import sys
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest

import er_gym  # noqa: F401  (registers the environments)
from er_gym.envs.embodied_env import EmbodiedEnv

ID = "ER-SinglePickup-v0"
SIZE = {"width": 64, "height": 40}


@pytest.fixture
def shown(monkeypatch: pytest.MonkeyPatch) -> Iterator[gymnasium.Env[Any, Any]]:
    """An environment with a window that nobody sees."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setitem(EmbodiedEnv.metadata, "render_fps", 1000)
    env = gymnasium.make(ID, obs_mode="rgb", render_mode="human", **SIZE)
    yield env
    env.close()


def on_screen() -> np.ndarray:
    pygame = pytest.importorskip("pygame", reason="needs the extra render")
    return pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)


def test_modes_are_declared_and_others_refused() -> None:
    assert EmbodiedEnv.metadata == {"render_modes": ["ansi", "human", "rgb_array"], "render_fps": 1}
    with pytest.raises(ValueError, match="unknown render_mode 'svg'; choose one of: ansi, human"):
        EmbodiedEnv(render_mode="svg")


def test_a_window_shows_each_reset_and_step(shown: gymnasium.Env[Any, Any]) -> None:
    obs, _ = shown.reset(seed=3)
    first = on_screen()
    assert np.array_equal(first, obs["rgb"])
    place = shown.unwrapped.details["navigable"][0]  # type: ignore[attr-defined]
    obs, *_ = shown.step(f"navigate to {place}")
    assert np.array_equal(on_screen(), obs["rgb"])
    assert not np.array_equal(on_screen(), first)
    assert shown.render() is None
    twin = copy.deepcopy(shown)  # has a window of its own, or none
    twin.close()
    shown.close()
    obs, _ = shown.reset(seed=3)
    assert np.array_equal(on_screen(), first)


def test_a_window_keeps_the_rate_of_pictures(
    shown: gymnasium.Env[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    pygame = pytest.importorskip("pygame", reason="needs the extra render")
    rates = []

    class Clock:
        def tick(self, per_second: float) -> None:
            rates.append(per_second)

    monkeypatch.setattr(pygame.time, "Clock", Clock)
    shown.reset(seed=3)
    shown.step("observe")
    assert rates == [1000, 1000]


def test_a_window_shows_what_no_observation_draws(shown: gymnasium.Env[Any, Any]) -> None:
    blind = gymnasium.make(ID, obs_mode="text", render_mode="human", **SIZE)
    obs, _ = shown.reset(seed=3)
    blind.reset(seed=3)
    assert np.array_equal(on_screen(), obs["rgb"])
    blind.close()


def test_words_say_where_the_agent_is_and_what_it_was_told() -> None:
    env = gymnasium.make(ID, obs_mode="state", render_mode="ansi")
    _, info = env.reset(seed=3)
    inner = env.unwrapped
    assert isinstance(inner, EmbodiedEnv)
    for said in ("observe", "pickup Fridge"):
        text = env.render()
        assert isinstance(text, str)
        pose, first = inner.agent_pose, text.splitlines()[0]
        assert first.startswith(
            f"You are in {inner.task.scene}, at x {pose.x:.2f} m, z {pose.z:.2f}"
        )
        assert f"You hold: {info['held'] or 'nothing'}." in text
        assert f"You see: {', '.join(inner.details['visible'])}." in text
        assert info["feedback"] in text
        info = env.step(said)[4]
    env.close()


def test_without_pygame_one_line_says_what_to_install(
    shown: gymnasium.Env[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(gymnasium.error.DependencyNotInstalled) as caught:
        shown.reset(seed=0)
    assert "pip install 'er-gym[render]'" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_without_a_display_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame", reason="needs the extra render")
    monkeypatch.setattr(pygame.display, "get_driver", lambda: "offscreen")
    monkeypatch.delenv("SDL_VIDEODRIVER", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    env = EmbodiedEnv(obs_mode="text", render_mode="human", **SIZE)
    with pytest.warns(UserWarning, match="finds no display, so nothing is shown; take"):
        env.reset(seed=0)
    env.close()
    monkeypatch.setenv("SDL_VIDEODRIVER", "nonsense")
    with pytest.raises(
        gymnasium.error.Error, match=r"cannot open a window \(.*\); take render_mode"
    ):
        env.reset(seed=0)
    env.close()
