"""How much an observation tells of the next sight of a thing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from untrained_policy import write_untrained_run

from agents.rl.config import EnvConfig, TrainConfig
from agents.rl.policy_file import load_network, policy_file
from benchmarks.checks.next_sight import (
    SECOND,
    Prediction,
    SearchStates,
    gathered,
    learn,
    main,
    without,
    worth_of,
    worth_of_first,
)
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import names
from er_gym.tasks import load_suite, verbs
from er_gym.thor.objects import KIND_OF

OPTIONS = EnvConfig(episodes="mini", subtasks=True, sightings=True, max_steps=40)


@pytest.fixture(scope="module")
def policy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = tmp_path_factory.mktemp("policy") / "run"
    write_untrained_run(TrainConfig(total_steps=1, env=OPTIONS), run)
    return policy_file(run)


@pytest.fixture(scope="module")
def states(policy: Path) -> SearchStates:
    return gathered(policy, OPTIONS, 60, seed=3)


def test_what_an_action_is_worth() -> None:
    """To open the closed place shows the thing; to go there and open it takes two actions."""
    tasks = load_suite("mini").tasks
    task = next(each for each in tasks if each.type.name == "single_pickup_from_closerep")
    thing = next(each.object_type for each in task.key_actions if each.verb == verbs.PICKUP)
    place = next(each.object_type for each in task.key_actions if each.verb == verbs.OPEN)
    with (
        EmbodiedEnv(obs_mode="state", instances="target") as env,
        EmbodiedEnv(obs_mode="state", instances="target") as trying,
    ):
        _, info = env.reset(options={"task": task})
        go, opens = Action(verbs.NAVIGATE, place), Action(verbs.OPEN, place)
        while not info["action_mask"][INDEX[go]]:
            _, _, _, _, info = env.step(Action(verbs.OBSERVE))
        before = env.snapshot()
        worth = worth_of(trying, before, env.action_masks(), KIND_OF[thing])
        assert worth[INDEX[go]] == np.float32(SECOND)
        assert env.snapshot() == before
        legal = set(np.flatnonzero(env.action_masks()).tolist())
        tried = set(np.flatnonzero(~np.isnan(worth)).tolist())
        assert tried <= legal
        assert {ACTIONS[number].verb for number in legal - tried} <= {
            *(verbs.END, verbs.TOGGLE, verbs.PICKUP, verbs.PUT)
        }
        _, _, _, _, info = env.step(go)
        assert thing not in names(info["interactable_mask"])
        worth = worth_of(trying, env.snapshot(), env.action_masks(), KIND_OF[thing])
        assert worth[INDEX[opens]] == 1.0


def test_a_network_learns_it(policy: Path, states: SearchStates) -> None:
    """Of states that it has learnt by heart, it finds what there is to find."""
    everything = np.arange(len(states.since))
    best = np.nanmax(states.worth, axis=1)
    assert 0.1 < best.mean() < 0.9
    untaught = worth_of_first(Prediction(load_network(policy)), states, everything)
    assert untaught.mean() < 0.5 * best.mean()
    model = learn(Prediction(load_network(policy)), states, everything, epochs=150)
    worth = worth_of_first(model, states, everything)
    assert (worth <= best).all()
    assert worth.mean() > 0.8 * best.mean()
    untried = torch.from_numpy(np.isnan(states.worth)).float()
    first = [each[~np.isnan(each)][0] for each in states.worth]
    assert worth_of_first(lambda _: untried, states, everything).tolist() == first
    blind = without(states, ["subtask", "sightings"])
    assert not blind.obs["subtask"].any()
    assert blind.obs["state"].any()


def test_the_table(policy: Path) -> None:
    command = [str(policy), "--states", "40", "--epochs", "1", "--workers", "1"]
    result = CliRunner().invoke(main, [*command, "--without", "sightings"])
    assert result.exit_code == 0, result.output
    rows: Any = [line.split("|")[1:-1] for line in result.output.splitlines() if "|" in line]
    first = [cell.strip() for cell, *_ in rows]
    assert first[2:] == [
        "the policy",
        "a network that has learnt it",
        "a network that has learnt it, without sightings",
        "the best",
    ]
    policy_row, *_, best = rows[2:]
    assert policy_row[-1].strip() == "-"
    assert float(best[-1].split()[0]) > 0


def test_what_cannot_be_asked(tmp_path: Path, policy: Path) -> None:
    write_untrained_run(
        TrainConfig(total_steps=1, env=EnvConfig(episodes="mini")), tmp_path / "run"
    )
    blind = CliRunner().invoke(main, [str(tmp_path / "run")])
    assert blind.exit_code == 1
    assert "does not observe subtasks" in blind.output
    wrong = CliRunner().invoke(main, [str(policy), "--without", "state"])
    assert wrong.exit_code == 1
    assert "observes subtask and sightings" in wrong.output
    missing = CliRunner().invoke(main, ["zoo:nothing"])
    assert missing.exit_code == 1
    assert "nothing" in missing.output
