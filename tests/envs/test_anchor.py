"""The anchor of a step: equal where agents know the same and stand in the same place."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.suites import load_suite


@pytest.fixture(scope="module")
def env() -> Iterator[EmbodiedEnv]:
    task = next(t for t in load_suite("mini").tasks if t.scene == "FloorPlan410")
    made = EmbodiedEnv([task], obs_mode="state+anchor")
    yield made
    made.close()


def anchors(env: EmbodiedEnv, *actions: str) -> list[str]:
    """After reset and after each action."""
    obs, info = env.reset(seed=0)
    found = [info["anchor"]]
    assert obs["anchor"].tobytes().hex() == info["anchor"]
    for action in actions:
        *_, info = env.step(action)
        found.append(info["anchor"])
    return found


def test_it_is_the_same_whichever_way_one_came(env: EmbodiedEnv) -> None:
    anchors(env, "observe")
    first, second, third = env.unwrapped.details["navigable"][:3]
    one = anchors(env, "observe", *(f"navigate to {place}" for place in (first, second, third)))
    other = anchors(env, "observe", *(f"navigate to {place}" for place in (second, first, third)))
    same = [a == b for a, b in zip(one, other, strict=True)]
    assert same == [True, True, False, False, True]
    assert len({*one}) == 5
    assert one[:2] == anchors(env, "observe")


def test_it_tells_what_was_tried_and_what_came_of_it(env: EmbodiedEnv) -> None:
    start = anchors(env)[0]
    tried = anchors(env, "slice Bread")[1]
    assert tried not in (start, anchors(env, "slice Apple")[1])
    twice = anchors(env, "slice Bread", "slice Bread")
    assert len({*twice}) == 3  # a fourth time would end the episode


def test_it_stays_in_a_snapshot_and_costs_nothing_unasked(env: EmbodiedEnv) -> None:
    anchor = anchors(env, "observe")[1]
    saved = env.snapshot()
    env.step("move forward")
    assert env.restore(saved)[1]["anchor"] == anchor
    with EmbodiedEnv([env.task], obs_mode="state") as plain:
        assert "anchor" not in plain.reset(seed=0)[1]
