"""Episodes that start within a demonstration go on as if the learner had come that way itself."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from agents.rl.config import EnvConfig, TrainConfig
from agents.rl.envs import LearningEnv, make_env
from agents.rl.guidance import NearGoal
from agents.rl.model_file import KEPT
from agents.rl.near_goal import MOMENT, Moment, demonstrated, moment_at
from agents.rl.near_goal_callback import NearGoalCurriculum
from agents.rl.train import train
from agents.scripted.searcher import SearcherAgent
from er_gym.envs.actions import INDEX
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

TYPE = "ordered_pickup_two_object_and_put"
OPTIONS = EnvConfig(
    episodes="mini",
    subtasks=True,
    sightings=True,
    types=(TYPE,),
    shaping=1.0,
    key_actions=0.25,
    step_penalty=0.0,
)
GAMMA = 0.9


@pytest.fixture(scope="module")
def env() -> LearningEnv:
    made = make_env(OPTIONS, GAMMA, near=1.0)
    assert isinstance(made, LearningEnv)
    return made


@pytest.fixture(scope="module")
def task() -> Task:
    """One that the searcher does; it has 11 key actions."""
    found = [task for task in load_suite("mini").tasks if task.type.name == TYPE]
    return next(task for task in found if task.scene == "FloorPlan416")


@pytest.fixture(scope="module")
def moments(env: LearningEnv, task: Task) -> tuple[Moment, ...]:
    return demonstrated(env.unwrapped, env.policy_observation, task)  # type: ignore[arg-type]


Step = tuple[int, dict[str, Any], np.ndarray, dict[str, Any], float, bool]


def go_on(env: LearningEnv, actions: list[int], obs: Any, info: Any) -> list[Step]:
    """Of each state: key actions left, observation, mask, info, reward, whether it is the last."""
    told = [(info["key_actions_left"], obs, env.action_masks(), info, 0.0, False)]
    for action in actions:
        obs, reward, over, _, info = env.step(action)
        told.append((info["key_actions_left"], obs, env.action_masks(), info, float(reward), over))
    return told


@pytest.fixture(scope="module")
def whole(env: LearningEnv, task: Task) -> tuple[list[int], list[Step]]:
    """The searcher's episode, played by the learner's environment."""
    agent, actions = SearcherAgent(), []
    obs, info = env.reset(options={"task": task})
    agent.reset(task, obs, info)
    over = False
    while not over:
        actions.append(INDEX[agent.act(obs, info).action])  # type: ignore[index]
        _, _, over, _, info = env.step(actions[-1])
    assert info["success"]
    obs, info = env.reset(options={"task": task})
    return actions, go_on(env, actions, obs, info)


def test_a_demonstration_has_a_moment_for_each_key_action(
    moments: tuple[Moment, ...], whole: tuple[list[int], list[Step]]
) -> None:
    lefts = list(dict.fromkeys(step[0] for step in whole[1]))
    # The first is the beginning; after the last, the episode is over.
    assert [each.left for each in moments] == lefts[1:-1]
    assert moments[0].left == lefts[0] - 1


def test_the_start_is_the_state_of_the_demonstration(
    env: LearningEnv, moments: tuple[Moment, ...], whole: tuple[list[int], list[Step]]
) -> None:
    """All that the learner observes and earns from there on is that of the unbroken episode."""
    actions, steps = whole
    for moment in (moments[0], moments[len(moments) // 2], moments[-1]):
        at = next(number for number, step in enumerate(steps) if step[0] == moment.left)
        obs, info = env.reset(options={MOMENT: moment})
        again = go_on(env, actions[at:], obs, info)
        assert len(again) == len(steps) - at
        for number, (one, other) in enumerate(zip(again, steps[at:], strict=True)):
            assert one[0] == other[0]
            assert one[1].keys() == other[1].keys()
            assert all(np.array_equal(one[1][key], other[1][key]) for key in one[1])
            assert np.array_equal(one[2], other[2])
            assert one[3]["steps"] == other[3]["steps"]
            if number:  # with its shaping and the worth of key actions
                assert one[4] == pytest.approx(other[4])
                assert one[5] == other[5]
        assert again[-1][3]["success"]


def test_a_key_action_earns_what_training_says(whole: tuple[list[int], list[Step]]) -> None:
    """0.25, and the potential, minus the share that is left."""
    steps = whole[1]
    before, after = next((one, other) for one, other in pairwise(steps) if other[0] == one[0] - 1)
    count = steps[0][0]
    shaping = (one := before[0] / count) - GAMMA * after[0] / count
    assert one > 0
    assert after[4] == pytest.approx(0.25 + shaping)


def test_the_position_chooses_the_moment() -> None:
    made = [Moment(left, b"", b"") for left in (7, 5, 4)]
    found = [moment_at(made, position) for position in (8, 7, 6, 5, 4, 3)]
    assert [each and each.left for each in found] == [None, 7, 5, 5, 4, None]
    assert moment_at((), 2) is None


def test_episodes_start_at_the_position(env: LearningEnv) -> None:
    env.set_positions({TYPE: 4})
    starts = []
    for seed in range(4):
        _, info = env.reset(seed=seed)
        starts.append((info["started_at"], info["key_actions_left"] <= 4))
        _, _, _, _, info = env.step(INDEX_OBSERVE)
        assert info["started_at"] == starts[-1][0]
    assert (4, True) in starts
    assert all(start in ((4, True), (0, False)) for start in starts)  # the searcher failed
    env.set_positions({TYPE: 40})
    assert env.reset(seed=0)[1]["started_at"] == 0
    env.set_positions({})
    assert env.reset(seed=0)[1]["started_at"] == 0


INDEX_OBSERVE = next(number for action, number in INDEX.items() if action.verb == "observe")


def test_the_start_moves_back_and_forward() -> None:
    rule = NearGoal(first=2, further_at=0.75, nearer_below=0.5, over=4)
    assert rule.moved(2, (True, True, True)) == 2  # too few
    assert rule.moved(2, (True, True, True, False)) == 3
    assert rule.moved(5, (True, True, False, False)) == 5
    assert rule.moved(5, (True, False, False, False)) == 4
    assert rule.moved(2, (False, False, False, False)) == 2
    with pytest.raises(ValidationError, match=r"nearer_below is 0\.9, more than further_at, 0\.8"):
        NearGoal(nearer_below=0.9)


def test_positions_follow_the_episodes_that_started_there() -> None:
    curriculum = NearGoalCurriculum(NearGoal(types=(TYPE,), over=2))
    heard: list[Any] = []
    model = SimpleNamespace(**{KEPT: {}})
    env: Any = SimpleNamespace(env_method=lambda *told: heard.append((told[0], dict(told[1]))))
    curriculum.begin(env, model)  # type: ignore[arg-type]
    assert heard == [("set_positions", {TYPE: 2})]
    for at, success in ((2, True), (0, False), (7, False)):
        curriculum.note({"task_type": TYPE, "started_at": at, "is_success": success})
    curriculum.note({})
    assert not curriculum.move()
    curriculum.note({"task_type": TYPE, "started_at": 2, "is_success": True})
    assert curriculum.move()
    assert curriculum.positions == {TYPE: 3}
    assert not curriculum.move()  # by episodes at the new position only
    again = NearGoalCurriculum(NearGoal(types=(TYPE,), over=2))
    kept = {"near_goal": {TYPE: [3, [False]]}}
    again.begin(env, SimpleNamespace(**{KEPT: kept}))  # type: ignore[arg-type]
    assert heard[-1] == ("set_positions", {TYPE: 3})
    again.note({"task_type": TYPE, "started_at": 3, "is_success": False})
    again.move()
    assert again.positions == {TYPE: 2}


@pytest.mark.parametrize(
    ("episodes", "evaluated", "why"),
    [("mini", "er-val", "plays in rooms that are kept for evaluation, such as FloorPlan"),
     ("er-val", "er-val", "is the one of evaluation")],
)  # fmt: skip
def test_only_training_tasks_are_demonstrated(
    make_config: Any, tmp_path: Path, episodes: str, evaluated: str, why: str
) -> None:
    config: TrainConfig = make_config(
        near_goal={},
        env={"episodes": episodes},
        evaluation={"episodes": evaluated},
    )
    with pytest.raises(ValueError, match=f"near_goal demonstrates tasks, and .*{why}"):
        train(config, tmp_path / "run")
    assert not (tmp_path / "run").exists()
