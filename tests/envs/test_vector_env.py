"""The vector environment gives what Gymnasium's own gives over the same environments."""

from __future__ import annotations

import copy
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, VectorEnv

from er_gym.envs.actions import ACTIONS
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.vector import EmbodiedVectorEnv
from er_gym.envs.vector.member import MemberEnv, can_act_ahead
from er_gym.envs.wrappers import KeyActionShaping
from er_gym.tasks.types import TASK_TYPES

ID = "ER-PickupAndPut-v0"
N = 4
SMALL = {"width": 32, "height": 24}
Vector = VectorEnv[Any, Any, Any]


def made(mode: AutoresetMode = AutoresetMode.NEXT_STEP, n: int = N, **arguments: Any) -> Vector:
    arguments = {"obs_mode": "state", **arguments}
    return gymnasium.make_vec(ID, num_envs=n, autoreset_mode=mode, **arguments)


def gymnasiums_own(
    mode: AutoresetMode = AutoresetMode.NEXT_STEP, n: int = N, **arguments: Any
) -> Vector:
    arguments = {"obs_mode": "state", **arguments}
    own = {"autoreset_mode": mode, "copy": arguments.pop("copy", True)}
    return gymnasium.make_vec(
        ID, num_envs=n, vectorization_mode="sync", vector_kwargs=own, **arguments
    )


def assert_same(one: Any, other: Any, where: str = "") -> None:
    """Two results are the same, with their types and shapes."""
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key in one:
            assert_same(one[key], other[key], f"{where}/{key}")
    elif isinstance(one, tuple):
        assert len(one) == len(other), where
        for k, pair in enumerate(zip(one, other, strict=True)):
            assert_same(*pair, f"{where}/{k}")
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), where
        if one.dtype == object:
            for k in range(len(one)):
                assert_same(one[k], other[k], f"{where}/{k}")
        else:
            assert one.tobytes() == other.tobytes(), where
    else:
        assert one == other, where


def legal(info: dict[str, Any], random: np.random.Generator) -> np.ndarray:
    """A random legal action of each environment; now and then any action."""
    chosen = (random.random(info["action_mask"].shape) * info["action_mask"]).argmax(axis=1)
    any_action = random.integers(len(ACTIONS), size=len(chosen))
    return np.where(random.random(len(chosen)) < 0.1, any_action, chosen)


def compare(ours: Vector, theirs: Vector, steps: int, seed: Any = 3) -> int:
    """Play the same actions in both; returns how many episodes ended."""
    random, over = np.random.default_rng(0), np.zeros(ours.num_envs, dtype=bool)
    ended = 0
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert ours.metadata == theirs.metadata
    results = [env.reset(seed=seed) for env in (ours, theirs)]
    assert_same(*results)
    for number in range(steps):
        last = results[0][-1]
        if ours.metadata["autoreset_mode"] is AutoresetMode.DISABLED and over.any():
            results = [
                env.reset(seed=number, options={"reset_mask": over.copy(), "suite": "er-1k"})
                for env in (ours, theirs)
            ]
            assert_same(*results, f"reset {number}")
            mask = np.where(over[:, None], results[0][1]["action_mask"], last["action_mask"])
            last = {"action_mask": mask}
        actions = legal(last, random)
        results = [env.step(actions) for env in (ours, theirs)]
        assert_same(*results, f"step {number}")
        over = results[0][2] | results[0][3]
        ended += int(over.sum())
    assert_same(ours.call("action_masks"), theirs.call("action_masks"))
    assert ours.np_random_seed == theirs.np_random_seed
    ours.close()
    theirs.close()
    return ended


@pytest.mark.parametrize("mode", AutoresetMode)
def test_every_step_is_that_of_gymnasiums_own(mode: AutoresetMode):
    arguments = {"max_steps": 8, "step_penalty": 0.1, "faults": 0.2}
    assert compare(made(mode, **arguments), gymnasiums_own(mode, **arguments), 40) >= N * 3


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_pictures_and_texts_are_those_of_gymnasiums_own(mode: AutoresetMode):
    arguments = {"obs_mode": "rgb+depth+instance+objects+text", "max_steps": 4, **SMALL}
    ours, theirs = made(mode, n=2, **arguments), gymnasiums_own(mode, n=2, **arguments)
    assert compare(ours, theirs, 6, seed=[7, 11]) >= 2


def test_an_outer_step_limit_is_that_of_gymnasiums_own():
    assert compare(made(max_episode_steps=3), gymnasiums_own(max_episode_steps=3), 9) >= N


def test_the_papers_protocol_and_text_actions():
    arguments = {"protocol": "paper", "obs_mode": "text"}
    ours, theirs = made(n=2, **arguments), gymnasiums_own(n=2, **arguments)
    assert_same(ours.reset(seed=0), theirs.reset(seed=0))
    for actions in (["observe", "navigate to Fridge"], ["what", "end"], [0, "move forward"]):
        assert_same(ours.step(actions), theirs.step(actions))


def test_a_random_seed_is_drawn_for_each():
    vector = made()
    vector.reset()
    assert len({*vector.np_random_seed}) == N


@pytest.mark.parametrize("own", [True, False])
def test_observations_are_the_callers_own_if_asked_for(own: bool):
    vector = made(copy=own)
    first, info = vector.reset(seed=0)
    before = copy.deepcopy(first)
    masks = info["action_mask"].copy()
    second, *_ = vector.step(["observe"] * N)
    assert (second["state"] is first["state"]) is not own
    assert np.array_equal(first["state"], before["state"]) is own
    assert np.array_equal(info["action_mask"], masks)
    assert info["_steps"] is not info["_action"]


def test_every_id_has_it_and_it_is_the_default():
    for kind in TASK_TYPES:
        vector = gymnasium.make_vec(kind.env_id, num_envs=2, obs_mode="text")
        assert type(vector) is EmbodiedVectorEnv
        assert isinstance(vector.metadata["autoreset_mode"], AutoresetMode)
        _, info = vector.reset(seed=0)
        assert info["task_type"].tolist() == [kind.name] * 2
        assert info["action_mask"].shape == (2, len(ACTIONS))
        assert vector.spec is not None
        vector.close()


def test_attributes_and_methods_of_each_environment():
    vector = made(n=2, render_mode="ansi")
    vector.reset(seed=0)
    assert vector.get_attr("render_mode") == ("ansi", "ansi")
    assert [task.id for task in vector.get_attr("task")] == [
        env.unwrapped.task.id for env in vector.envs
    ]
    assert all(text.startswith("You are in") for text in vector.render())
    vector.set_attr("name", "one")
    assert vector.get_attr("name") == ("one", "one")
    vector.set_attr("name", ["one", "two"])
    assert vector.get_attr("name") == ("one", "two")
    with pytest.raises(ValueError, match="3 values of 'name'; give 2"):
        vector.set_attr("name", [1, 2, 3])
    vector.close()
    with pytest.raises(ResetNeeded, match="closed"):
        vector.step([0, 0])


@pytest.mark.parametrize(
    ("actions", "told"),
    [
        (np.zeros(3, int), r"int64 of shape \(3,\); give an array of 4"),
        (np.zeros((4, 1), int), r"int64 of shape \(4, 1\)"),
        (np.zeros(4), r"float64 of shape \(4,\)"),
        (5, "the actions are 5; give"),
        ("observe", "the actions are 'observe'"),
        ([0, 0, 0], r"the actions are \[0, 0, 0\]"),
        ([0, 0, 0, 1.5], "1.5 is not an action"),
        (np.array([0, 0, 9999, 0]), "the action of environment 2 is 9999; give an index from 0"),
        (np.array([0, 0, 0, -1]), "the action of environment 3 is -1"),
    ],
)
def test_wrong_actions_change_nothing(actions: Any, told: str, vector_of_four: Vector):
    _, before = vector_of_four.reset(seed=0)
    with pytest.raises(gymnasium.error.InvalidAction, match=told):
        vector_of_four.step(actions)
    _, _, _, _, info = vector_of_four.step(np.zeros(N, int))
    assert info["steps"].tolist() == (before["steps"] + 1).tolist()


@pytest.fixture(scope="module")
def vector_of_four() -> Vector:
    return made()


def test_wrong_arguments_are_one_line():
    for arguments, told in (
        ({"n": 0}, "num_envs is 0; give a whole number from 1"),
        ({"mode": "Now"}, "unknown autoreset_mode 'Now'; choose one of: NextStep"),
        ({"copy": 1}, "copy is 1; give True or False"),
        ({"max_episode_steps": 0}, "max_episode_steps is 0"),
        ({"episode_source": "nowhere"}, "nowhere"),
    ):
        with pytest.raises(ValueError, match=told) as raised:
            made(**arguments)
        assert "\n" not in str(raised.value)


def test_wrong_resets_change_nothing(vector_of_four: Vector):
    vector_of_four.reset(seed=0)
    before = vector_of_four.get_attr("task")
    masks: list[Any] = [[True] * N, np.ones(3, bool), np.ones(N), np.zeros(N, bool)]
    for mask in masks:
        with pytest.raises(ValueError, match=r"option 'reset_mask' at reset is .* of 4 Booleans"):
            vector_of_four.reset(options={"reset_mask": mask})
    with pytest.raises(ValueError, match="3 seeds for 4 environments"):
        vector_of_four.reset(seed=[1, 2, 3])
    assert vector_of_four.get_attr("task") == before


def test_an_episode_that_is_over_waits_if_autoreset_is_disabled():
    vector = made(AutoresetMode.DISABLED)
    vector.reset(seed=0)
    vector.step(["end", "observe", "end", "observe"])
    with pytest.raises(ResetNeeded, match="the episodes of environments 0, 2 are over"):
        vector.step(np.zeros(N, int))
    options = {"reset_mask": np.array([True, False, True, False])}
    _, info = vector.reset(options=options)
    assert info["_steps"].tolist() == [True, False, True, False]
    assert [*options] == ["reset_mask"]
    assert vector.step(["observe"] * N)[-1]["steps"].tolist() == [2, 3, 2, 3]


class Curious(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Looks at the environment before a step."""

    def step(self, action: Any) -> Any:
        before = self.unwrapped.agent_pose  # type: ignore[attr-defined]
        obs, reward, terminated, truncated, info = self.env.step(action)
        after = self.unwrapped.agent_pose  # type: ignore[attr-defined]
        return obs, reward + (after != before), terminated, truncated, info


class Contrary(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Changes the action, and claims not to."""

    looks_after_step = True

    def step(self, action: Any) -> Any:
        return self.env.step(0)


def around(wrap: Any, n: int = 2) -> EmbodiedVectorEnv:
    envs = [wrap(MemberEnv(obs_mode="state")) for _ in range(n)]
    return EmbodiedVectorEnv.around(envs, AutoresetMode.NEXT_STEP)


def test_a_wrapper_that_looks_before_a_step_sees_what_was_before():
    vector = around(Curious)
    vector.reset(seed=0)
    _, rewards, *_ = vector.step(["move forward", "end"])
    assert rewards.tolist() == [1.0, 0.0]
    assert not can_act_ahead(vector.envs[0])
    assert can_act_ahead(KeyActionShaping(MemberEnv(), 0.9))


def test_a_wrapper_that_changes_an_action_is_refused():
    vector = around(Contrary)
    vector.reset(seed=0)
    with pytest.raises(gymnasium.error.Error, match=r"changed the action 2 into 0; .* cannot"):
        vector.step(np.array([2, 2]))


def test_an_environment_can_also_be_stepped_alone():
    vector, other = around(lambda env: env), made(n=2, episode_source="mini", task_type=None)
    for each in (vector, other):
        each.reset(seed=0)
    for action in ("observe", "move forward"):
        alone = vector.envs[1].step(action)
        _, _, _, _, info = other.step(["observe", action])
        for name in ("action_mask", "navigable_mask", "feedback"):
            assert_same(alone[-1][name], info[name][1])
        assert (vector.envs[1].action_masks() == alone[-1]["action_mask"]).all()
    obs, _, _, _, info = vector.step(["observe", "observe"])
    assert_same(obs["state"][1], other.step(["observe", "observe"])[0]["state"][1])
    assert info["steps"].tolist() == [2, 4]


def test_an_error_in_one_environment_leaves_the_others_where_they_are(
    monkeypatch: pytest.MonkeyPatch,
):
    vector = made(n=3)
    vector.reset(seed=0)
    with monkeypatch.context() as patched:
        broken = vector.envs[1].unwrapped._episode._handler
        patched.setattr(broken, "execute", lambda *_: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            vector.step(["observe"] * 3)
    assert vector.envs[0].step("move forward")[-1]["action"] == "move forward"
    assert [env.action_masks().sum() > 0 for env in (vector.envs[0], vector.envs[2])] == [True] * 2
    with pytest.raises(ResetNeeded, match="broken off"):
        vector.step(["observe"] * 3)
    _, info = vector.reset(options={"reset_mask": np.array([False, True, False])})
    assert info["steps"].tolist() == [0, 1, 0]
    assert vector.step(["move forward"] * 3)[-1]["action"].tolist() == ["move forward"] * 3


def test_a_copy_goes_on_like_the_original():
    vector = made(n=2)
    vector.reset(seed=0)
    vector.step(["observe", "move forward"])
    again = copy.deepcopy(vector)
    assert_same(*(each.step(["move forward", "observe"]) for each in (vector, again)))
