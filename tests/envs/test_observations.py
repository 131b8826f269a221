"""The state and text observations hold only what the agent could know."""

from __future__ import annotations

import numpy as np
import pytest
from floor_plan_1 import FRIDGE
from support import make_task

from er_gym.envs.asked_goal import GOAL_VERBS, goal
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.observations import (
    FEATURES,
    OBSERVATIONS,
    SCALARS,
    STATE_LAYOUT,
    parse_obs_mode,
)
from er_gym.tasks.task import AgentPose


def entry(obs: dict[str, np.ndarray], name: str) -> float:
    return float(obs["state"][STATE_LAYOUT.index(name)])


@pytest.fixture(scope="module")
def state_env() -> EmbodiedEnv:
    return EmbodiedEnv([], obs_mode="state+text")


@pytest.mark.parametrize(
    ("instruction", "names"),
    [
        ("Find the CreditCard in the room.", ["CreditCard"]),
        ("put the credit card on the dining table", ["CreditCard", "DiningTable"]),
        ("First Cup on GarbageCan, then Mug.", ["Cup", "GarbageCan", "Mug"]),
        ("Switch on the TV remote control", ["RemoteControl"]),
        ("Pick up the pencils", ["Pencil"]),
        ("Find the CD", ["CD"]),
        ("Stop panicking", []),
    ],
)  # fmt: skip
def test_goal_names(instruction: str, names: list[str]) -> None:
    assert [name for name, _ in goal(instruction)[1]] == names


def test_goal_weights_fall_with_the_order_of_mention() -> None:
    assert [weight for _, weight in goal("an Apple, a Bowl and a Cup")[1]] == [1.0, 0.5, 1 / 3]


@pytest.mark.parametrize(
    ("instruction", "verbs"),
    [
        ("Find the Apple.", {"search"}),
        ("Please take the Apple.", {"pickup"}),
        ("First put the Apple on the Desk", {"put", "then"}),
        ("Turn on the lamp", {"toggle"}),
    ],
)
def test_goal_verbs(instruction: str, verbs: set[str]) -> None:
    asked = goal(instruction)[0]
    assert {name for name, yes in zip(GOAL_VERBS, asked, strict=True) if yes} == verbs


def test_state_follows_what_happens(state_env: EmbodiedEnv) -> None:
    task = make_task("single_pickup", ("open", FRIDGE), instruction="Take the Egg.")
    obs, _ = state_env.reset(options={"task": task})
    assert [entry(obs, name) for name in ("right", "ahead", "sin", "cos")] == [0, 0, 0, 1]
    assert entry(obs, "goal:Egg") == 1.0
    assert entry(obs, "seen:Egg") == 0.0
    assert entry(obs, "holding") == 0.0
    state_env.step("navigate to Fridge")
    obs, *_ = state_env.step("open Fridge")
    assert [entry(obs, f"{f}:Fridge") for f in ("at", "open", "visible")] == [1, 1, 1]
    assert [entry(obs, f"{f}:Egg") for f in ("visible", "seen", "interactable")] == [1, 1, 1]
    obs, *_ = state_env.step("pickup Egg")
    assert entry(obs, "held:Egg") == 1.0
    assert entry(obs, "holding") == 1.0
    obs, *_ = state_env.step("navigate to Stool")
    assert entry(obs, "visible:Fridge") == 0.0
    assert entry(obs, "open:Fridge") == 1.0  # remembered
    assert entry(obs, "at:Fridge") == 0.0


def test_state_does_not_know_what_lies_in_a_closed_thing(state_env: EmbodiedEnv) -> None:
    """Two tasks that differ only in what the agent cannot know look the same."""
    cup, plate = "Cup|+00.37|+01.64|-02.58", "Plate|+00.96|+01.65|-02.61"
    seen = []
    for hidden in (cup, plate):
        task = make_task("single_pickup", ("pickup", hidden), instruction="Take it.")
        obs, _ = state_env.reset(options={"task": task})
        seen.append(obs)
    assert (seen[0]["state"] == seen[1]["state"]).all()
    assert seen[0]["text"] == seen[1]["text"]
    assert "Plate" not in seen[0]["text"]


def test_state_is_relative_to_the_start(state_env: EmbodiedEnv) -> None:
    task = make_task("single_pickup", ("open", FRIDGE))
    state_env.reset(options={"task": task})
    obs, *_ = state_env.step("move forward")
    assert entry(obs, "ahead") == pytest.approx(0.05, abs=1e-6)  # half a metre, by 10 m
    assert entry(obs, "right") == pytest.approx(0.0, abs=1e-6)


def test_state_keeps_to_its_bounds(state_env: EmbodiedEnv) -> None:
    state_env.reset(options={"task": make_task("single_pickup", ("open", FRIDGE))})
    state_env._episode._memory.start = AgentPose(99.0, 0.9, -99.0, 0.0)
    obs, *_ = state_env.step("observe")
    assert [entry(obs, name) for name in ("right", "ahead")] == [-1, 1]
    assert obs["state"] in state_env.observation_space["state"]


def test_text_keeps_to_its_characters(state_env: EmbodiedEnv) -> None:
    task = make_task("single_pickup", ("open", FRIDGE), instruction="Find the “Egg” — 找鸡蛋")
    obs, _ = state_env.reset(options={"task": task})
    assert obs["text"].startswith('Task: Find the "Egg" - ???')
    assert obs["text"] in state_env.observation_space["text"]


@pytest.mark.parametrize("mode", ["", "rgb+rgb", "normals", "rgb,state"])
def test_bad_obs_modes(mode: str) -> None:
    with pytest.raises(ValueError, match="unknown obs_mode"):
        parse_obs_mode(mode)


# -- what is remembered ----------------------------------------------------------------------------


def test_state_remembers_what_was_done_to_what(state_env: EmbodiedEnv) -> None:
    task = make_task("single_pickup", ("open", FRIDGE), instruction="Take the Egg.")
    obs, _ = state_env.reset(options={"task": task})
    assert [entry(obs, name) for name in ("repeats", "last navigate to", "last:Fridge")] == [0] * 3
    state_env.step("navigate to Fridge")
    obs, *_ = state_env.step("navigate to Fridge")
    assert entry(obs, "did navigate to:Fridge") == 0.5  # twice, of 4
    assert entry(obs, "repeats") == pytest.approx(2 / 3)
    assert [entry(obs, name) for name in ("last navigate to", "last:Fridge")] == [1, 1]
    obs, *_ = state_env.step("pickup Egg")  # refused: it is shut in
    assert entry(obs, "did pickup:Egg") == 0.0
    assert entry(obs, "last:Egg") == 1.0
    assert entry(obs, "repeats") == pytest.approx(1 / 3)
    state_env.step("open Fridge")
    obs, *_ = state_env.step("pickup Egg")
    assert [entry(obs, name) for name in ("did open:Fridge", "did pickup:Egg")] == [0.25, 0.25]
    assert [entry(obs, name) for name in ("last:Fridge", "last:Egg")] == [0, 1]


def test_state_remembers_where_it_saw_what_it_wants(state_env: EmbodiedEnv) -> None:
    task = make_task(
        "single_pickup", ("open", FRIDGE), instruction="Take the Egg to the Microwave."
    )
    obs, _ = state_env.reset(options={"task": task})
    obs, *_ = state_env.step("navigate to Fridge")
    before = entry(obs, "found:Fridge")
    assert before < 1.0  # the egg is shut in; the microwave may be in view
    obs, *_ = state_env.step("open Fridge")
    assert entry(obs, "found:Fridge") == 1.0
    state_env.step("pickup Egg")
    obs, *_ = state_env.step("navigate to Window")
    assert entry(obs, "found:Fridge") == 1.0
    assert entry(obs, "found:Window") < 1.0  # what is in the hand is not found there


def test_a_new_episode_begins_with_nothing_remembered(state_env: EmbodiedEnv) -> None:
    task = make_task("single_pickup", ("open", FRIDGE), instruction="Take the Egg.")
    first, _ = state_env.reset(options={"task": task})
    state_env.step("navigate to Fridge")
    state_env.step("open Fridge")
    again, _ = state_env.reset(options={"task": task})
    assert (first["state"] == again["state"]).all()


def test_the_layout_names_every_entry_once() -> None:
    assert len(STATE_LAYOUT) == len(set(STATE_LAYOUT)) == len(SCALARS) + len(FEATURES) * 124


@pytest.mark.parametrize(
    ("name", "low", "high", "shape", "dtype"),
    [
        ("rgb", 0, 255, (64, 96, 3), "uint8"),
        ("depth", 0, 40, (64, 96), "float32"),
        ("objects", -1, 1, (124, 6), "float32"),
        ("state", -1, 1, (len(STATE_LAYOUT),), "float32"),
    ],
)
def test_the_bounds_of_spaces(
    name: str, low: float, high: float, shape: tuple[int, ...], dtype: str
) -> None:
    space = OBSERVATIONS.get(name).space(96, 64)
    assert (space.low.min(), space.low.max()) == (low, low)
    assert (space.high.min(), space.high.max()) == (high, high)
    assert (space.shape, space.dtype) == (shape, np.dtype(dtype))
