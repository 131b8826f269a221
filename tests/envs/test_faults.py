"""Faults: which actions go wrong, how often, and what an agent learns of it."""

from __future__ import annotations

import copy
import pickle
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest

from er_gym.envs.action_handler import StepContext
from er_gym.envs.actions import ACTIONS, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.faults import KIND_OF_VERB, KINDS, FaultPlan, other_places, parse_faults
from er_gym.envs.info import action_of, with_details
from er_gym.envs.legality import KnownTypes
from er_gym.envs.skills import Outcome
from er_gym.envs.solver import Solver
from er_gym.envs.wrappers import FaultInjection, KeyActionShaping
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import play_episode
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

MINI = load_suite("mini").tasks
NAVIGATIONS = np.array([action.verb == verbs.NAVIGATE for action in ACTIONS], np.int8)
SWEEP = [MINI[place] for place in (36, 51, 60, 96, 104, 108)]


@pytest.fixture(scope="module")
def envs() -> Iterator[Callable[..., EmbodiedEnv]]:
    """Makes environments, and closes them in the end."""
    made: list[EmbodiedEnv] = []

    def make(**arguments: Any) -> EmbodiedEnv:
        made.append(EmbodiedEnv(MINI, **{"obs_mode": "text", **arguments}))
        return made[-1]

    yield make
    for env in made:
        env.close()


def steps(env: Any, task: Task, seed: int) -> list[dict[str, Any]]:
    """The infos of an episode of an agent that knows the task, and tries again what failed."""
    _, info = env.reset(seed=seed, options={"task": task})
    infos, solver, over = [info], Solver(), False
    while not over:
        action = action_of(info) if info["fault"] else solver.next(with_details(env, info))[0]
        _, reward, terminated, truncated, info = env.step(action)
        infos.append({**info, "reward": reward})
        over = terminated or truncated
    return infos


def course(infos: Iterable[dict[str, Any]]) -> list[tuple[str, str, str]]:
    return [(info["action"], info["fault"], info["feedback"]) for info in infos]


class Carried:
    """An action handler that carries out everything, and remembers how often."""

    navigated_to = ""

    def __init__(self) -> None:
        self.done: Counter[Action] = Counter()

    def execute(self, action: Action, *_: Any) -> tuple[str, Outcome]:
        self.done[action] += 1
        return "id", Outcome(None, True)


# -- what goes wrong -----------------------------------------------------------------------------


def test_a_faulty_navigation_arrives_elsewhere(envs: Callable[..., EmbodiedEnv]) -> None:
    env = envs(faults={"navigate": 1})
    _, info = env.reset(seed=1, options={"task": MINI[0]})
    assert info["fault"] == ""
    before, known = env.agent_pose, env.details["navigable"]
    goal = known[0]
    _, reward, _, _, info = env.step(f"navigate to {goal}")
    place = info["object_id"].split("|")[0]
    assert (info["action_success"], info["fault"], reward) == (False, "navigate", 0)
    assert info["feedback"] == f"You could not navigate to {goal}: you arrived at {place} instead."
    assert place in known
    assert place != goal
    assert env.agent_pose != before
    # It stands where it would stand if it had meant to go there.
    there = env.agent_pose
    twin = envs()
    twin.reset(seed=1, options={"task": MINI[0]})
    twin.step(f"navigate to {place}")
    assert twin.agent_pose == there


def test_of_a_faulty_interaction_nothing_changes(envs: Callable[..., EmbodiedEnv]) -> None:
    env = envs(faults=dict.fromkeys([kind for kind in KINDS if kind != "navigate"], 1))
    seen: dict[str, str] = {}
    for task in SWEEP:
        _, info = env.reset(seed=3, options={"task": task})
        solver, over = Solver(), False
        while not over:
            action = action_of(info) if info["fault"] else solver.next(with_details(env, info))[0]
            before, pose, done = env.objects, env.agent_pose, info["key_actions_done"]
            _, reward, terminated, truncated, info = env.step(action)
            over = terminated or truncated
            if info["fault"]:
                assert not info["action_success"]
                assert reward == 0
                assert list(env.objects) == list(before)
                assert env.agent_pose == pose
                assert info["key_actions_done"] == done
                assert info["fault"] == KIND_OF_VERB[action.verb]
                assert "fault" not in info["feedback"]
                seen[info["fault"]] = info["feedback"]
    assert seen.keys() == {*KINDS} - {"navigate"}
    assert len(set(seen.values())) == len(seen)


def test_there_may_be_nowhere_else(envs: Callable[..., EmbodiedEnv]) -> None:
    env = envs(faults=1)
    env.reset(seed=1, options={"task": MINI[0]})
    episode = env._current("a test")
    handler, perception = episode._handler, episode.perception
    handler._known = KnownTypes(["Fridge"])  # type: ignore[attr-defined]
    object_id, outcome = handler.execute(
        Action(verbs.NAVIGATE, "Fridge"), StepContext(perception, episode._available, ())
    )
    assert (object_id, outcome.perception, outcome.success) == ("", None, False)
    assert outcome.problem == "you did not get there, and are still where you were"


def test_elsewhere_is_not_near_the_goal(envs: Callable[..., EmbodiedEnv]) -> None:
    env = envs()
    env.reset(seed=0, options={"scene": "FloorPlan1"})
    objects = env._current("a test").perception.objects
    (sink,) = objects.of_type("Sink")
    inside = {objects.type_of(row) for row in objects.contents[sink]}
    known = ["CounterTop", "Fridge", "Sink", "SinkBasin", "Unheard", *sorted(inside)]
    assert "Fridge" in other_places("Sink", known, objects)
    assert not {"Sink", "SinkBasin", "Unheard", *inside}.intersection(
        other_places("Sink", known, objects)
    )
    fridge = objects.ids[objects.of_type("Fridge")[0]]
    assert "Fridge" not in other_places("Sink", known, objects, fridge)


# -- how often -----------------------------------------------------------------------------------


def test_rates_hold_and_a_third_try_goes_through() -> None:
    actions = [Action(verb, "Fridge") for verb in KIND_OF_VERB if verb != verbs.NAVIGATE]
    tries = 4000
    for rate in (0.1, 0.3, 1.0):
        inner = Carried()
        plan = FaultPlan({kind: rate for kind in KINDS if kind != "toggle"}, (5,))
        handler = plan.handler(inner, KnownTypes(()))  # type: ignore[arg-type]
        for action in actions:
            faults = []
            for _ in range(tries):
                handler.execute(action, None)  # type: ignore[arg-type]
                faults.append(handler.fault)
            assert inner.done[action] == faults.count("")
            if action.verb == verbs.TOGGLE:
                assert not any(faults)
                continue
            text = "".join("x" if fault else "." for fault in faults)
            assert "xxx" not in text
            # A chain with states 0, 1 and 2 faults in a row, of which the last never faults.
            expected = (rate + rate**2) / (1 + rate + rate**2)
            assert text.count("x") / tries == pytest.approx(expected, abs=0.025)


def test_at_rate_1_an_agent_that_tries_again_succeeds(envs: Callable[..., EmbodiedEnv]) -> None:
    for protocol in ("default", "paper"):
        env = envs(faults=1.0, protocol=protocol, max_steps=300)
        for task in SWEEP:
            infos = steps(env, task, seed=2)
            assert infos[-1]["success"], (protocol, task.id, infos[-1]["end_reason"])
            # The judge counted no action that went wrong.
            assert all(info["reward"] == 0 for info in infos if info["fault"])
            assert len({info["fault"] for info in infos}) > 2


# -- which: the seed -----------------------------------------------------------------------------


def test_a_seed_gives_the_same_faults_whatever_ran_before(
    envs: Callable[..., EmbodiedEnv],
) -> None:
    env, other = envs(faults=0.3), envs(faults=0.3)
    first = [course(steps(env, task, seed=4)) for task in SWEEP]
    assert [course(steps(other, task, seed=4)) for task in reversed(SWEEP)][::-1] == first
    assert [course(steps(env, task, seed=5)) for task in SWEEP] != first
    assert {fault for each in first for _, fault, _ in each} > {"", "navigate", "open"}


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_with_the_same_faults(
    envs: Callable[..., EmbodiedEnv], copied: Callable[[Any], Any]
) -> None:
    env = FaultInjection(envs(), 0.5, seed=8)
    for seed in (6, None):
        env.reset(seed=seed, options={"task": MINI[3]})
        random = np.random.default_rng(1)

        def step(*of: Any, random: Any = random) -> list[Any]:
            action = random.choice(np.flatnonzero(of[0].action_masks() & NAVIGATIONS))
            return [(info["fault"], info["feedback"]) for *_, info in (e.step(action) for e in of)]

        for _ in range(5):
            step(env)
        twin = copied(env)
        pairs = [step(env, twin) for _ in range(10)]
        assert all(one == other for one, other in pairs)
        assert any(one[0] for one, _ in pairs)
        # A reset without a seed draws the next one from the same generator.
        for each in (env, twin):
            each.reset(options={"task": MINI[4]})
        assert all(one == other for one, other in (step(env, twin) for _ in range(10)))
        twin.close()


def test_without_faults_nothing_changes(envs: Callable[..., EmbodiedEnv]) -> None:
    plain, none = envs(), envs(faults={"open": 0})
    for env in (plain, none):
        _, info = env.reset(seed=1)
        assert info["fault"] == env.step("observe")[4]["fault"] == ""
    # The generator of tasks is not asked for the seed of faults that there are not.
    assert plain.reset()[1]["task_id"] == none.reset()[1]["task_id"]


def test_an_action_that_is_refused_or_unknown_has_no_fault(
    envs: Callable[..., EmbodiedEnv],
) -> None:
    env = envs(faults=1)
    _, info = env.reset(seed=1, options={"task": MINI[0]})
    for action in (f"navigate to {env.details['navigable'][0]}", "slice Apple", "hm", "observe"):
        info = env.step(action)[4]
        assert bool(info["fault"]) == action.startswith("navigate")


def test_a_record_says_which_steps_were_faults(envs: Callable[..., EmbodiedEnv]) -> None:
    class GoesSomewhere:
        def reset(self, task: Task, obs: Any, info: Any) -> None: ...

        def act(self, obs: Any, info: Any) -> Decision:
            return Decision(f"navigate to {info['navigable'][0]}")

    record = play_episode(envs(faults=1, max_steps=3), GoesSomewhere(), MINI[0], 1)
    assert [bool(step.fault) for step in record.steps] == [False, True, True]
    assert '"fault"' not in record.steps[0].model_dump_json()


# -- the wrapper ---------------------------------------------------------------------------------


def test_the_wrapper_sets_the_environments_own_faults(envs: Callable[..., EmbodiedEnv]) -> None:
    made = envs(faults=0.3)
    inner = envs()
    wrapped = FaultInjection(KeyActionShaping(inner, gamma=1.0), 0.3)
    task = MINI[108]
    assert course(steps(wrapped, task, 4)) == course(steps(made, task, 4))
    inner.reset(seed=4, options={"task": task})
    FaultInjection(inner, 0)
    inner.step("observe")
    assert inner._current("a test").faults is not None  # the episode under way keeps its faults
    inner.reset(seed=4)
    assert inner._current("a test").faults is None
    other = FaultInjection(inner, 0.3, seed=1)
    assert course(steps(other, task, 4)) != course(steps(made, task, 4))
    with pytest.raises(ValueError, match="CartPoleEnv has no faults; wrap an er-gym environment"):
        FaultInjection(gymnasium.make("CartPole-v1"), 0.1)
    with pytest.raises(ValueError, match="the seed of faults is -1; give a whole number from 0"):
        FaultInjection(inner, 0.1, seed=-1)


# -- errors --------------------------------------------------------------------------------------

KIND_LIST = "navigate, open, close, pickup, put, toggle"


@pytest.mark.parametrize(
    ("faults", "message"),
    [
        (1.5, r"faults is 1\.5; give a rate from 0 to 1"),
        (float("nan"), "faults is nan; give a rate from 0 to 1"),
        (True, "faults is True; give a rate from 0 to 1"),
        ("0.1", rf"faults is '0\.1'; give a rate from 0 to 1, or .*the kinds are: {KIND_LIST}"),
        (None, "faults is None; give a rate"),
        ({"slice": 0.1}, f"unknown kind of fault 'slice'; there are: {KIND_LIST}"),
        ({"open": -0.1}, r"faults\['open'\] is -0\.1; give a rate from 0 to 1"),
        ({"open": "1"}, r"faults\['open'\] is '1'; give a rate from 0 to 1"),
    ],
)
def test_bad_rates_are_named_in_one_line(faults: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        EmbodiedEnv((), faults=faults)
    assert "\n" not in str(caught.value)


def test_rates_can_be_written() -> None:
    assert parse_faults("0.1") == 0.1
    assert parse_faults("0") == parse_faults("open=0") == 0
    assert parse_faults("open=0.1, navigate = 1") == {"navigate": 1.0, "open": 0.1}
    assert list(parse_faults("open=0.1,navigate=1")) == ["navigate", "open"]  # type: ignore[arg-type]
    for text in ("", "x", "open", "open=", "open=0.1,", "open=0.1,put", "nan", "2", "open=2"):
        with pytest.raises(ValueError, match=r"faults.* give a rate from 0 to 1"):
            parse_faults(text)
    with pytest.raises(ValueError, match="state a rate for 'open' twice"):
        parse_faults("open=0.1,open=0.2")
