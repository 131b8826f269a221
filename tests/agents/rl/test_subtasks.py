"""Subtasks: read from the instruction, followed from what the agent does, and advised upon."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from gymnasium import spaces

from agents.rl.adviser import Adviser
from agents.rl.config import EnvConfig
from agents.rl.envs import LearningEnv, make_env
from agents.rl.subtask_memory import SUBTASK_LAYOUT, SubtaskMemory
from agents.rl.subtasks import FIND, Progress, Subtask, subtasks
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.info import names
from er_gym.tasks import verbs

TO_SEE = frozenset(
    {
        *("visible_mask", "held", "interactable_mask", "action_mask"),
        *("verb", "object_type", "action_success", "steps", "max_steps"),
    }
)
HEAT = (
    Subtask("pickup", "Potato"),
    Subtask("put in", "Potato", "Microwave"),
    Subtask("close", "Microwave"),
    Subtask("toggle", "Microwave"),
    Subtask("toggle", "Microwave"),
    Subtask("pickup", "Potato"),
)


@pytest.mark.parametrize(
    ("instruction", "steps"),
    [
        ("Find the Mug.", (Subtask(FIND, "Mug"),)),
        ("Turn on the FloorLamp.", (Subtask("toggle", "FloorLamp"),)),
        (
            "Take the Egg that is in the Fridge and put it in the Bowl.",
            (
                Subtask("pickup", "Egg", source="Fridge"),
                Subtask("put in", "Egg", "Bowl"),
            ),
        ),
        (
            "First heat the Potato in the Microwave; then put the Potato on the Plate.",
            (*HEAT, Subtask("pickup", "Potato"), Subtask("put in", "Potato", "Plate")),
        ),
        (
            "Slice the Lettuce with the Knife and lay the Knife down in the SinkBasin.",
            (
                Subtask("pickup", "Knife"),
                Subtask("slice", "Lettuce", "Knife"),
                Subtask("pickup", "Knife"),
                Subtask("put in", "Knife", "SinkBasin"),
            ),
        ),
        ("Colourless green ideas.", ()),
    ],
)
def test_an_instruction_is_a_list_of_subtasks(instruction: str, steps: tuple[Subtask, ...]) -> None:
    assert subtasks(instruction) == steps


def test_the_water_is_turned_on_once() -> None:
    steps = subtasks("Wash the Mug in the SinkBasin, then wash the Cup in the SinkBasin.")
    assert [step.thing for step in steps] == ["Mug", "Mug", "Faucet", "Mug", "Cup", "Cup", "Cup"]


def test_what_is_done_follows_from_actions_and_hand() -> None:
    progress = Progress("Put the Egg in the Bowl, then find the Mug.")
    none: frozenset[str] = frozenset()

    def at() -> tuple[str, str]:
        now = progress.at()
        return (now.verb, now.thing) if now else ("", "")

    assert at() == ("pickup", "Egg")
    assert not progress.update(Action("pickup", "Apple"), "Apple", none)
    assert progress.update(Action("pickup", "Egg"), "Egg", none)
    assert at() == ("put in", "Egg")
    assert progress.update(Action("put in", "Plate"), "", none)  # elsewhere: fetch it again
    assert at() == ("pickup", "Egg")
    progress.update(Action("pickup", "Egg"), "Egg", none)
    assert progress.update(Action("put in", "Bowl"), "", none)
    assert at() == (FIND, "Mug")
    assert progress.update(None, "", frozenset({"Mug"}))
    assert progress.at() is None


@pytest.fixture(scope="module")
def env() -> Iterator[LearningEnv]:
    env = make_env(EnvConfig(episodes="mini", subtasks=True), advised=True).env
    yield env
    env.close()


def test_the_observation_needs_nothing_that_an_agent_is_not_told(env: LearningEnv) -> None:
    obs, info = env.reset(seed=3)
    assert isinstance(env.observation_space, spaces.Dict)
    memory = SubtaskMemory(info["instruction"])
    random = np.random.default_rng(0)
    over = False
    while not over:
        told = {name: info[name] for name in TO_SEE}
        assert np.array_equal(memory.update(told), obs["subtask"])
        assert env.observation_space["subtask"].contains(obs["subtask"])
        legal = [k for k in info["action_mask"].nonzero()[0] if ACTIONS[k].verb != verbs.END]
        obs, _, terminated, truncated, info = env.step(int(random.choice(legal)))
        over = terminated or truncated


def test_the_observation_remembers_the_search(env: LearningEnv) -> None:
    def on(obs: dict[str, np.ndarray], entry: str) -> float:
        return float(obs["subtask"][SUBTASK_LAYOUT.index(entry)])

    obs, info = env.reset(seed=3)
    now = env.policy_observation.subtasks.progress.at()
    assert on(obs, f"now {now.verb}") == on(obs, f"thing:{now.thing}") == 1
    place = next(name for name in names(info["navigable_mask"]) if name != now.thing)
    assert on(obs, f"tried:{place}") == 0
    once = env.step(INDEX[Action("navigate to", place)])[0]
    assert 0 < on(once, f"tried:{place}") == on(once, f"visits:{place}") < 1
    assert on(once, "all done") == 0


def test_the_adviser_finishes_what_another_has_begun_badly(env: LearningEnv) -> None:
    """It is asked after each action, a sixth of which are not what it said."""
    random = np.random.default_rng(1)
    env.reset(seed=8)
    adviser, successes, illegal, others = Adviser(), 0, 0, 0
    for _ in range(12):
        _, info = env.reset()
        adviser.begin(env.unwrapped.task, info, env.policy_observation.subtasks)
        over = False
        while not over:
            advice = INDEX[adviser.advise(info)]
            illegal += not info["action_mask"][advice]
            legal = [k for k in info["action_mask"].nonzero()[0] if ACTIONS[k].verb != verbs.END]
            disobeys = random.random() < 1 / 6
            others += disobeys
            _, _, terminated, truncated, info = env.step(
                int(random.choice(legal)) if disobeys else advice
            )
            over = terminated or truncated
        successes += info["success"]
    assert others > 12
    assert illegal <= 2
    assert successes >= 6
