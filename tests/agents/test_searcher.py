"""The searcher reads instructions, uses no privileged knowledge, and beats the random agent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

import numpy as np
import pytest

from agents import make_agent
from agents.scripted.searcher import instruction as words
from agents.scripted.searcher.instruction import Goal, parse_instruction
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.object_view import ObjectView
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.judge import search_targets
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task
from er_gym.tasks.types import TASK_TYPES

Deeds = list[tuple[str, str]]
MACHINES = {
    words.BREW: ("CoffeeMachine", 1),
    words.HEAT: ("Microwave", 2),
    words.TOAST: ("Toaster", 1),
    words.CHILL: ("Fridge", 0),
}


def deeds_of(goals: Iterable[Goal]) -> Deeds:
    """What is to be done to which types, but for getting about, opening and closing."""
    found: Deeds = []
    held, water = "", False

    def take(thing: str) -> None:
        nonlocal held
        if held != thing:
            found.append((verbs.PICKUP, thing))
        held = thing

    def put(thing: str, place: str) -> None:
        nonlocal held
        take(thing)
        found.append((verbs.PUT, BASIN_OF.get(place, place)))
        held = ""

    goals = list(goals)
    for goal in goals:
        if goal.kind == words.FIND and len(goals) == 1:
            found.append((words.FIND, goal.object_type))
        elif goal.kind == words.TAKE:
            take(goal.object_type)
        elif goal.kind == words.PUT:
            put(goal.object_type, goal.target)
        elif goal.kind == words.TOGGLE:
            found.append((verbs.TOGGLE, goal.object_type))
        elif goal.kind == words.SLICE:
            take(goal.target)
            found.append((verbs.SLICE, goal.object_type))
        elif goal.kind == words.WASH:
            put(goal.object_type, "SinkBasin")
            found += [] if water else [(verbs.TOGGLE, "Faucet")]
            water = True
            take(goal.object_type)
        elif goal.kind in MACHINES:
            machine, times = MACHINES[goal.kind]
            put(goal.object_type, machine)
            found += [(verbs.TOGGLE, machine)] * times
            take(goal.object_type)
    return found


def deeds_asked(task: Task) -> Deeds:
    if task.type.search:
        return [(words.FIND, name) for name in search_targets(task)]
    handled = (verbs.PICKUP, verbs.PUT, verbs.TOGGLE, verbs.SLICE)
    return [
        (key.verb, BASIN_OF.get(key.actual_type, key.actual_type))
        for key in task.key_actions
        if key.verb in handled
    ]


def misread(tasks: Iterable[Task]) -> list[str]:
    return [
        t.instruction for t in tasks if deeds_of(parse_instruction(t.instruction)) != deeds_asked(t)
    ]


@pytest.mark.parametrize("suite", ["mini", "er-1k"])
def test_instructions_of_suites_are_understood(suite: str) -> None:
    tasks = load_suite(suite).tasks
    wrong = misread(tasks)
    assert len(wrong) <= 0.01 * len(tasks), wrong[:5]


def test_instructions_of_the_paper_are_understood(shared_data) -> None:
    tasks = read_tasks(shared_data / "paper_tasks_dev.json")
    wrong = misread(tasks)
    assert len(wrong) <= 0.02 * len(tasks), wrong[:5]


@pytest.mark.parametrize(
    ("instruction", "goals"),
    [
        ("Bring me the credit card.", [Goal("take", "CreditCard")]),
        ("Could you tell me where the watch is?", [Goal("find", "Watch")]),
        ("Flip the switch of the CoffeeMachine", [Goal("toggle", "CoffeeMachine")]),
        ("Switch the desk lamp off.", [Goal("toggle", "DeskLamp")]),
        ("Drop the pen into the bin.", [Goal("put", "Pen", "GarbageCan")]),
        ("Make sure the apple ends up in the fridge.", [Goal("put", "Apple", "Fridge")]),
        ("The box belongs on the sofa.", [Goal("put", "Box", "Sofa")]),
        ("Take the Book that is on the Desk.", [Goal("take", "Book", source="Desk")]),
        (
            "Put the Cup on the Shelf after putting the Mug in the Fridge.",
            [Goal("put", "Mug", "Fridge"), Goal("put", "Cup", "Shelf")],
        ),
        (
            "First, place Cup on GarbageCan, then, place Mug on SinkBasin.",
            [Goal("put", "Cup", "GarbageCan"), Goal("put", "Mug", "SinkBasin")],
        ),
        (
            "Open the fridge, take the egg and close the fridge.",
            [Goal("open", "Fridge"), Goal("take", "Egg"), Goal("close", "Fridge")],
        ),
        ("Colourless green ideas sleep furiously.", []),
        ("", []),
    ],
)
def test_other_wordings_are_understood_too(instruction: str, goals: list[Goal]) -> None:
    assert list(parse_instruction(instruction)) == goals


@pytest.fixture(scope="module")
def env() -> Iterable[EmbodiedEnv]:
    env = EmbodiedEnv([], obs_mode="text+objects", instances="explore")
    yield env
    env.close()


class Blinkered:
    """An agent from whom all is kept that only the environment should know."""

    told = frozenset(
        {
            *("visible_mask", "navigable_mask", "interactable_mask", "action_mask", "held"),
            *("action_success", "feedback", "steps", "max_steps"),
            *("object_views", "object_views_around"),
        }
    )

    def __init__(self, name: str) -> None:
        self.agent = make_agent(name)
        self.obs_mode = self.agent.obs_mode

    def told_of(self, info: Mapping[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in info.items() if name in self.told}

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        only_words = Task("", TASK_TYPES[0], "", task.instruction, ())
        self.agent.reset(only_words, obs, self.told_of(info))

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Any:
        return self.agent.act(obs, self.told_of(info))


@pytest.mark.parametrize("name", ["searcher", "spotter"])
def test_it_has_no_privileged_knowledge_and_plays_the_same_again(
    env: EmbodiedEnv, name: str
) -> None:
    for task in load_suite("mini").tasks[::6]:
        open_eyed = play_episode(env, make_agent(name, 1), task, 0)
        blinkered = play_episode(env, Blinkered(name), task, 0)
        assert [step.text for step in open_eyed.steps] == [step.text for step in blinkered.steps]
        assert not blinkered.error


def test_it_solves_most_of_mini_without_breaking_rules(env: EmbodiedEnv) -> None:
    tasks = load_suite("mini").tasks
    records = [
        play_episode(env, make_agent("searcher"), task, episode_seed(0, task.id)) for task in tasks
    ]
    assert [record.error for record in records] == [""] * len(records)
    assert {record.end_reason for record in records} == {"end"}
    solved = [record for record in records if score_episode(record, CORRECTED).success]
    assert len(solved) >= 0.8 * len(records)
    steps = [step for record in records for step in record.steps]
    illegal = [step for step in steps if step.feedback.startswith("You cannot")]
    assert len(illegal) <= 0.02 * len(steps), [step.feedback for step in illegal[:5]]


class Onlooker:
    """Notes each time that a thing to be fetched is seen on a type of place that is not within
    reach, and what the agent does then."""

    def __init__(self, agent: Any) -> None:
        self.agent, self.obs_mode = agent, "text+objects"
        self.went: list[bool] = []

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        self.thing = parse_instruction(task.instruction)[0].object_type
        self.agent.reset(task, obs, info)

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Any:
        decided = self.agent.act(obs, info)
        seen = next((one for one in info["object_views"] if one.object_type == self.thing), None)
        places = {seen.on} & {*info["navigable"]} if seen else set()
        if places and self.thing not in info["navigable"] and decided.action.verb != verbs.OBSERVE:
            self.went.append(decided.action.object_type in places)
        return decided


def test_the_spotter_goes_to_where_it_sees_a_thing(env: EmbodiedEnv) -> None:
    tasks = [task for task in load_suite("mini").tasks if task.type.name == "single_pickup"]
    went: dict[str, list[bool]] = {}
    steps: dict[str, int] = {}
    for name in ("searcher", "spotter"):
        went[name], steps[name] = [], 0
        for task in tasks:
            onlooker = Onlooker(make_agent(name))
            steps[name] += len(play_episode(env, onlooker, task, 0).steps)
            went[name] += onlooker.went[:1]  # later it may have been there already
    assert len(went["spotter"]) > 2
    assert all(went["spotter"])
    assert not all(went["searcher"])
    assert steps["spotter"] < steps["searcher"]


def test_of_two_the_spotter_goes_to_the_nearer(env: EmbodiedEnv) -> None:
    task = next(task for task in load_suite("mini").tasks if task.type.name == "single_pickup")
    obs, told = env.reset(options={"task": task})
    info = with_details(env, told)
    thing = parse_instruction(task.instruction)[0].object_type
    assert thing not in info["navigable"]
    near, far = info["navigable"][:2]
    for one, other in ((near, far), (far, near)):
        views = tuple(
            ObjectView(f"{thing}|{number}", thing, 0.0, 1.0 + number, on)
            for number, on in enumerate((one, other))
        )
        agent = make_agent("spotter")
        agent.reset(task, obs, info)
        agent.act(obs, {**info, "object_views": views})  # looks about
        second = agent.act(obs, {**info, "object_views": views})
        assert isinstance(second, Decision)
        assert str(second.action) == f"navigate to {one}"


def test_the_spotter_takes_what_is_meant() -> None:
    """The toilet paper that is on the hanger, where there is more of it."""
    tasks = [task for task in load_suite("er-val").tasks if "-from_" in task.id]
    right, wrong = Counter[str](), Counter[str]()
    for instances, name in product(("explore", "target"), ("searcher", "spotter")):
        with EmbodiedEnv(obs_mode="text+objects", instances=instances) as env:
            for task in tasks:
                meant = {action.object_id for action in task.key_actions}
                steps = play_episode(env, make_agent(name), task, 0).steps
                took = [step for step in steps if step.verb == verbs.PICKUP and step.success]
                counts = right if took and took[0].object_id in meant else wrong
                counts[f"{name}, {instances}"] += 1
    assert wrong["spotter, explore"] < wrong["searcher, explore"]
    # There the environment knows which is meant, and nothing must keep the agent from it.
    assert wrong["spotter, target"] <= wrong["searcher, target"]
    assert right["spotter, target"] > 10


def test_the_spotter_takes_again_what_it_has_put_down(env: EmbodiedEnv) -> None:
    task = next(task for task in load_suite("er-val").tasks if "-from_" in task.id)
    goal = parse_instruction(task.instruction)[0]
    obs, told = env.reset(options={"task": task})
    elsewhere = ObjectView(f"{goal.object_type}|1", goal.object_type, 0.0, 1.0, "Floor")
    near = {
        **with_details(env, told),
        "object_views": (elsewhere,),
        "action_mask": np.ones_like(told["action_mask"]),
    }
    agent: Any = make_agent("spotter")
    agent.reset(task, obs, near)
    agent._source = goal.source
    agent._take_result(near)
    assert not agent._ready(goal.object_type, verbs.PICKUP)
    agent._take_result({**near, "held": goal.object_type})
    agent._take_result(near)
    assert agent._ready(goal.object_type, verbs.PICKUP)


def test_nonsense_ends_at_once(env: EmbodiedEnv) -> None:
    scene = load_suite("mini").tasks[0].scene
    task = Task("nonsense", TASK_TYPES[0], scene, "Colourless green ideas.", ())
    record = play_episode(env, make_agent("searcher"), task, 0)
    assert [step.verb for step in record.steps] == [verbs.INIT, verbs.END]


def test_the_searcher_gives_up_on_missing_objects_in_time(env: EmbodiedEnv) -> None:
    scene = load_suite("mini").tasks[0].scene
    task = Task("lacking", TASK_TYPES[0], scene, "Find the ShowerGlass in the Safe.", ())
    record = play_episode(env, make_agent("searcher"), task, 0)
    assert record.error == ""
    assert record.end_reason == "end"
