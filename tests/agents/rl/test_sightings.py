"""Sightings: where things were seen, by hand and in a room; a policy that begins to see them."""

from __future__ import annotations

from collections import Counter
from math import exp, log1p
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces
from pydantic import ValidationError
from untrained_policy import write_untrained_run

from agents.rl.agent import GreedyPolicy, RLAgent
from agents.rl.anchored import starting_network
from agents.rl.config import EnvConfig, how_learnt
from agents.rl.envs import make_env
from agents.rl.policy_file import MODEL, load_network, untrained_network
from agents.rl.sighting_memory import SIGHTING_FEATURES, SIGHTING_LAYOUT, SightingMemory
from agents.rl.subtasks import Progress
from er_gym.envs.actions import INDEX, Action
from er_gym.envs.info import names, with_details
from er_gym.envs.object_view import ObjectView
from er_gym.tasks import verbs
from er_gym.thor.objects import TYPES


def view(
    name: str,
    distance: float,
    bearing: float = 0.0,
    *,
    on: str = "",
    is_open: bool | None = None,
    number: int = 1,
) -> ObjectView:
    return ObjectView(f"{name}|{number}", name, bearing, distance, on, is_open)


def seeing(*ahead: ObjectView, held: str = "", **around: tuple[ObjectView, ...]) -> dict[str, Any]:
    return {"held": held, "object_views": ahead, "object_views_around": around}


def marked(vector: np.ndarray, feature: str) -> dict[str, float]:
    """The types with the feature."""
    row = vector.reshape(len(SIGHTING_FEATURES), len(TYPES))[SIGHTING_FEATURES.index(feature)]
    return {TYPES[kind]: float(row[kind]) for kind in row.nonzero()[0]}


def test_a_thing_is_on_what_it_was_seen_on() -> None:
    memory = SightingMemory(Progress("Put the Mug in the Microwave."))
    table, desk = view("DiningTable", 4.0, 90.0), view("Desk", 3.0, 0.0)
    seen = memory.update(seeing(desk, view("Mug", 4.0, on="DiningTable"), table))
    assert marked(seen, "thing on it") == {"DiningTable": 1.0}
    near = marked(seen, "thing near it")
    # One metre behind the desk; at right angles to the table.
    assert near == pytest.approx({"Desk": exp(-1), "DiningTable": exp(-(32**0.5))})
    assert marked(seen, "place on it") == marked(seen, "place near it") == {}
    # Out of view it is remembered, and counts less.
    later = memory.update(seeing(view("Desk", 1.0)))
    assert marked(later, "thing on it") == pytest.approx({"DiningTable": 0.7})
    assert marked(later, "thing near it") == pytest.approx(
        {name: 0.7 * nearness for name, nearness in near.items()}
    )
    # In the hand it lies nowhere; it is seen again where it is put.
    assert marked(memory.update(seeing(held="Mug")), "thing on it") == {}
    assert marked(memory.update(seeing(view("Mug", 1.0, on="Desk"))), "thing on it") == {"Desk": 1}


def test_the_subtask_says_what_is_the_thing() -> None:
    """What is seen before it is asked for counts once it is."""
    progress = Progress("Put the Mug in the Box, then pick up the Book.")
    memory = SightingMemory(progress)
    views = seeing(behind=(view("Book", 2.0, on="Bed"), view("Box", 2.0, 180.0, on="Desk")))
    seen = memory.update(views)
    assert marked(seen, "thing on it") == {}
    progress.number = 1  # put it in
    seen = memory.update(seeing())
    assert marked(seen, "place on it") == pytest.approx({"Desk": 0.7})
    progress.number = 2
    seen = memory.update(seeing())
    assert marked(seen, "thing on it") == pytest.approx({"Bed": 0.7})
    assert marked(seen, "place on it") == {}
    progress.number = 3  # all done
    assert marked(memory.update(seeing()), "thing on it") == {}


def test_objects_of_a_type_are_counted() -> None:
    def count(number: int) -> float:
        return log1p(number) / log1p(20)

    memory = SightingMemory(Progress("Pick up the Mug."))
    drawers = [view("Drawer", 1.0 + n, is_open=False, number=n) for n in range(3)]
    seen = memory.update(seeing(*drawers, view("Mirror", 3.0)))
    assert marked(seen, "number") == pytest.approx({"Drawer": count(3), "Mirror": count(1)})
    assert marked(seen, "closed") == pytest.approx({"Drawer": count(3)})
    assert marked(seen, "nearness") == pytest.approx({"Drawer": 0.5, "Mirror": 0.25})
    # One is open now, another is seen for the first time, the others are remembered.
    seen = memory.update(
        seeing(view("Drawer", 1, is_open=True, number=0), right=(view("Drawer", 9, number=7),))
    )
    assert marked(seen, "number")["Drawer"] == pytest.approx(count(4))
    assert marked(seen, "closed") == pytest.approx({"Drawer": count(2)})
    assert marked(seen, "nearness") == {"Drawer": 0.5}


def test_in_a_room_it_is_what_the_views_say() -> None:
    env: Any = make_env(EnvConfig(episodes="mini", subtasks=True, sightings=True))
    space = env.observation_space["sightings"]
    assert isinstance(space, spaces.Box)
    assert space.shape == (len(SIGHTING_LAYOUT),)
    random, checked = np.random.default_rng(0), Counter[bool]()
    env.reset(seed=5)
    for _ in range(8):
        obs, info = env.reset()
        for _ in range(12):
            assert space.contains(obs["sightings"])
            told = with_details(env, info)
            now = env.policy_observation.subtasks.progress.at()
            views = [told["object_views"], *[*told["object_views_around"].values()][::-1]]
            in_view = [
                one for each in views for one in each if now and one.object_type == now.thing
            ]
            if in_view and in_view[0].on:
                on = marked(obs["sightings"], "thing on it")
                assert on == {in_view[0].on: 1.0}
                checked[in_view[0] in views[0]] += 1
            place = str(random.choice(names(info["navigable_mask"])))
            looks = random.random() < 0.25
            action = Action(verbs.OBSERVE) if looks else Action(verbs.NAVIGATE, place)
            obs, _, over, _, info = env.step(INDEX[action])
            if over:
                break
    assert checked[True] > 10  # ahead
    assert checked[False] > 1  # about it
    env.close()


@pytest.fixture(scope="module")
def blind(make_config: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that observes subtasks, and no sightings."""
    run = tmp_path_factory.mktemp("start") / "run"
    env = {"episodes": "mini", "types": ["single_pickup"], "subtasks": True}
    write_untrained_run(make_config(env=env), run)
    return run


def test_a_policy_begins_to_see(make_config: Any, blind: Path) -> None:
    """It does the same as before, and what it sees can change that."""
    env = {"episodes": "mini", "types": ["single_pickup"], "subtasks": True, "sightings": True}
    config = make_config(env=env, start={"policy": str(blind)})
    assert how_learnt(config, 0).endswith("on state and subtask and sightings")
    network = starting_network(config, config.start)
    before = load_network(blind / MODEL)
    wanted = untrained_network(config).state_dict()
    assert {name: each.shape for name, each in network.state_dict().items()} == {
        name: each.shape for name, each in wanted.items()
    }
    room: Any = make_env(config.env)
    seen, _ = room.reset(seed=2)
    obs = {name: torch.as_tensor(each)[None].float() for name, each in seen.items()}
    obs["sightings"] = torch.rand(1, len(SIGHTING_LAYOUT))
    numbers, summary = network(obs)
    theirs, others = before(obs)
    assert torch.equal(numbers, theirs)
    assert torch.equal(summary, others)
    numbers.sum().backward()
    gradient = network.row.weight.grad
    assert gradient is not None
    fit = config.network.kind
    assert gradient[:, -fit - len(SIGHTING_FEATURES) : -fit].ne(0).any(dim=0).all()
    network.add_sightings()  # no more than once
    assert torch.equal(network(obs)[0], numbers)
    room.close()


def test_an_agent_that_sees_plays(make_config: Any, tmp_path: Path) -> None:
    env = {"episodes": "mini", "types": ["single_pickup"], "subtasks": True, "sightings": True}
    write_untrained_run(make_config(env=env), tmp_path / "run")
    agent, policy = RLAgent(tmp_path / "run"), GreedyPolicy.load(tmp_path / "run" / MODEL)
    assert agent.obs_mode == "state+objects"
    room: Any = make_env(EnvConfig.model_validate(env))
    seen, info = room.reset(seed=2)
    agent.reset(room.unwrapped.task, info["seen"], with_details(room, info))
    over, steps = False, 0
    while not over:
        decided = agent.act(info["seen"], with_details(room, info))
        number = INDEX[decided.action]  # type: ignore[index]
        assert number == policy.best(seen, info["action_mask"])  # as in training
        assert seen["sightings"].any()
        seen, _, over, _, info = room.step(number)
        steps += 1
    assert steps > 1
    room.close()


def test_sightings_need_subtasks() -> None:
    with pytest.raises(ValidationError, match="give subtasks=true, too"):
        EnvConfig(sightings=True)
