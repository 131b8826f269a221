"""``env.only_from_source``: a policy that takes the thing that is meant, not the one at hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from pydantic import ValidationError
from untrained_policy import write_untrained_run

from agents.rl.agent import RLAgent
from agents.rl.config import EnvConfig
from agents.rl.envs import make_env
from agents.rl.policy_file import MODEL, load_network
from agents.rl.policy_observation import _elsewhere
from agents.rl.subtask_memory import SUBTASK_LAYOUT
from agents.rl.subtasks import Progress
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.info import with_details
from er_gym.envs.object_view import ObjectView
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

OPTIONS = EnvConfig(episodes="mini", subtasks=True, sightings=True, only_from_source=True)
LOOKS = [
    number
    for number, action in enumerate(ACTIONS)
    if action.verb in (verbs.NAVIGATE, verbs.OPEN, verbs.OBSERVE)
]
PICKUPS = [number for number, action in enumerate(ACTIONS) if action.verb == verbs.PICKUP]


def tasks_with_a_source() -> list[Task]:
    """To pick up the toilet paper that is on the hanger, where there is more of it."""
    every = load_suite("er-val").tasks
    return [each for each in every if "single_pickup" in each.id and "-from_" in each.id]


def to_look(mask: np.ndarray, source: str, random: np.random.Generator) -> int:
    """An action that may show something, of the source if there is one."""
    looks = [number for number in LOOKS if mask[number]]
    there = [number for number in looks if ACTIONS[number].object_type == source]
    return int(random.choice(there if there and random.random() < 0.5 else looks))


@pytest.mark.parametrize("with_mask", [False, True])
def test_it_cannot_pick_up_what_lies_elsewhere(with_mask: bool) -> None:
    env: Any = make_env(OPTIONS, with_mask=with_mask)
    with pytest.raises(ResetNeeded):
        env.action_masks()
    random, withheld, took = np.random.default_rng(0), 0, []
    for task in tasks_with_a_source() * 4:
        obs, info = env.reset(options={"task": task})
        subtask = env.policy_observation.subtasks.progress.subtasks[0]
        pickup = INDEX[Action(verbs.PICKUP, subtask.thing)]
        can = SUBTASK_LAYOUT.index(f"can {verbs.PICKUP}:{subtask.thing}")
        over = False
        while not over:
            told, legal = with_details(env, info), env.unwrapped.action_masks()
            things = [each for each in told["object_views"] if each.object_type == subtask.thing]
            expected = legal.copy()
            if things and things[0].on not in ("", subtask.source):
                expected[pickup] = 0
            assert np.array_equal(env.action_masks(), expected)
            assert np.array_equal(info["action_mask"], expected)
            assert obs["subtask"][can] == expected[pickup]
            if with_mask:
                assert np.array_equal(obs["mask"], expected)
            withheld += int(legal[pickup] > expected[pickup])
            over = bool(expected[pickup])
            if over:
                info = env.step(pickup)[4]
                if things[0].on:  # else it could not see where it lay
                    took.append(info["object_id"] in [key.object_id for key in task.key_actions])
            else:
                number = to_look(legal, subtask.source, random)
                obs, _, terminated, truncated, info = env.step(number)
                over = terminated or truncated
    assert withheld > 5
    assert len(took) > 4
    assert all(took)
    env.close()


@pytest.mark.parametrize("only", [False, True])
def test_an_agent_takes_what_is_meant(make_config: Any, tmp_path: Path, only: bool) -> None:
    """Its network would rather pick up any."""
    options = OPTIONS.model_copy(update={"only_from_source": only})
    write_untrained_run(make_config(env=options.model_dump()), tmp_path / "run")
    agent = RLAgent(tmp_path / "run")
    network = load_network(tmp_path / "run" / MODEL)
    with torch.no_grad():
        network.each.bias[verbs.OBJECT_VERBS.index(verbs.PICKUP)] = 1e6
    agent._policy._network = network
    env: Any = make_env(options)
    took = []
    for seed, task in enumerate(tasks_with_a_source() * 3):
        random = np.random.default_rng(seed)
        _, info = env.reset(options={"task": task})
        agent.reset(task, info["seen"], with_details(env, info))
        subtask = env.policy_observation.subtasks.progress.subtasks[0]
        thing, source = subtask.thing, subtask.source
        over = False
        while not over:
            # The untrained network picks the thing up if it can; until then it is led around.
            legal = env.unwrapped.action_masks().copy()
            legal[[number for number in PICKUPS if ACTIONS[number].object_type != thing]] = 0
            info["action_mask"] = legal
            action = agent.act(info["seen"], with_details(env, info)).action
            if action.verb != verbs.PICKUP:  # type: ignore[union-attr]
                action = ACTIONS[to_look(legal, source, random)]
            _, _, terminated, truncated, info = env.step(INDEX[action])  # type: ignore[index]
            over = terminated or truncated or action.verb == verbs.PICKUP  # type: ignore[union-attr]
        if info["held"]:
            took.append(info["object_id"] in [key.object_id for key in task.key_actions])
    assert len(took) > 2
    assert all(took) == only
    env.close()


@pytest.mark.parametrize(
    ("instruction", "ons", "taken_before", "withheld"),
    [
        ("Pick up the Vase that is on the Shelf.", ("Desk", "Shelf"), False, True),
        ("Pick up the Vase that is on the Shelf.", ("Shelf", "Desk"), False, False),
        ("Pick up the Vase that is on the Shelf.", ("", "Desk"), False, False),
        ("Pick up the Vase that is on the Shelf.", (), False, False),
        ("Pick up the Vase.", ("Desk",), False, False),
        # It was taken from there, and then put on the desk.
        ("Put the Vase that is on the Shelf on the Bed.", ("Desk",), True, False),
        # Nobody can pick up a television.
        ("Put the Television that is on the TVStand on the Desk.", ("Desk",), False, False),
    ],
)
def test_what_is_withheld(
    instruction: str, ons: tuple[str, ...], taken_before: bool, withheld: bool
) -> None:
    progress = Progress(instruction)
    now = progress.at()
    assert now is not None
    assert now.verb == verbs.PICKUP
    if taken_before:
        progress.update(Action(verbs.PICKUP, now.thing), now.thing, frozenset())
        progress.update(Action(verbs.PUT, "Desk"), "", frozenset())
        assert progress.at() == now
    views = tuple(
        ObjectView(f"{now.thing}|{number}", now.thing, 0.0, 1.0 + number, on)
        for number, on in enumerate(ons)
    )
    chair = ObjectView("Chair|1", "Chair", 0.0, 0.5, "Rug")
    found = _elsewhere(progress, {"object_views": (chair, *views)})
    assert found == (Action(verbs.PICKUP, "Vase") if withheld else None)


def test_it_needs_sightings_and_the_nearest() -> None:
    with pytest.raises(ValidationError, match="for instances=explore"):
        EnvConfig(subtasks=True, sightings=True, only_from_source=True, instances="target")
    with pytest.raises(ValidationError, match="give sightings=true, too"):
        EnvConfig(subtasks=True, only_from_source=True)
