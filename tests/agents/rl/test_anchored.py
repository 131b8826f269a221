"""Learning goes on from a trained policy: values first, then near to the start."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger
from untrained_policy import write_untrained_run

from agents.rl.anchored import AnchoredPPO, divergence, starting_network
from agents.rl.callbacks import read_curve
from agents.rl.config import TrainConfig, how_learnt
from agents.rl.guidance import Start
from agents.rl.model_file import KEPT, restore, save
from agents.rl.policy_file import MODEL, load_network
from agents.rl.train import load_last_checkpoint, train
from er_gym.tasks.jsonl_format import write_tasks
from er_gym.tasks.suites import load_suite

ENVS, STEPS = 4, 16
ROLLOUT = ENVS * STEPS


@pytest.fixture(scope="module")
def start(make_config: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose policy is not uniform."""
    run = tmp_path_factory.mktemp("start") / "run"
    write_untrained_run(make_config(), run)
    return run


@pytest.fixture
def config(make_config: Any, start: Path) -> TrainConfig:
    made: TrainConfig = make_config(
        total_steps=4 * ROLLOUT,
        algorithm={"n_steps": STEPS, "batch_size": 32, "n_epochs": 2, "learning_rate": 1e-2},
        start={"policy": str(start), "value_steps": ROLLOUT, "kl": 0.4, "kl_steps": 4 * ROLLOUT},
    )
    return made


def learner(config: TrainConfig, folder: Path) -> AnchoredPPO:
    """One that began from the start, without environments."""
    model: AnchoredPPO = write_untrained_run(config, folder, steps=0)
    assert config.start is not None
    model.begin_from(starting_network(config, config.start))
    model.set_logger(Logger(None, []))
    return model


def learn(model: AnchoredPPO, steps: int, seed: int) -> None:
    """An update after so many steps, from a rollout of random numbers."""
    random = np.random.default_rng(seed)
    torch.manual_seed(seed)  # of the actions
    model.observation_space.seed(seed)
    model.rollout_buffer.reset()
    for _ in range(STEPS):
        seen: Any = [model.observation_space.sample() for _ in range(ENVS)]
        obs = {key: np.stack([each[key] for each in seen]) for key in seen[0]}
        legal = random.random((ENVS, model.action_space.n)) < 0.1  # type: ignore[attr-defined]
        legal[:, 0] = True
        with torch.no_grad():
            actions, values, log_prob = model.policy(
                model.policy.obs_to_tensor(obs)[0], action_masks=legal
            )
        model.rollout_buffer.add(
            obs, actions.numpy().reshape(-1, 1), random.normal(size=ENVS), np.zeros(ENVS), values,
            log_prob, action_masks=legal,
        )  # fmt: skip
    model.rollout_buffer.compute_returns_and_advantage(values, np.zeros(ENVS))
    model.num_timesteps = steps
    np.random.seed(seed)  # of the order of the steps
    model.train()


def weights(module: torch.nn.Module) -> dict[str, torch.Tensor]:
    return {name: each.clone() for name, each in module.state_dict().items()}


def same(one: dict[str, torch.Tensor], other: dict[str, torch.Tensor]) -> bool:
    return one.keys() == other.keys() and all(torch.equal(one[key], other[key]) for key in one)


def test_the_weight_of_the_divergence_falls_in_a_line() -> None:
    start = Start(policy="zoo:all", value_steps=100, kl=0.4, final_kl=0.25, kl_steps=200)
    found = [start.kl_weight(steps) for steps in (0, 100, 150, 200, 300, 1000)]
    assert found == pytest.approx([0.4, 0.4, 0.325, 0.25, 0.1, 0.1])


def test_the_divergence_is_that_of_the_legal_actions() -> None:
    start = torch.tensor([[0.75, 0.25, 5.0]]).log()
    now = torch.tensor([[0.5, 0.5, 9.0]]).log()
    wanted = 0.75 * np.log(0.75 / 0.5) + 0.25 * np.log(0.25 / 0.5)
    legal = torch.tensor([[1, 1, 0]])
    assert divergence(start, now, legal).tolist() == pytest.approx([wanted])
    assert divergence(start, start + 3, legal).tolist() == pytest.approx([0], abs=1e-6)


def test_the_value_function_learns_first(config: TrainConfig, start: Path, tmp_path: Path) -> None:
    model = learner(config, tmp_path / "run")
    extractor: Any = model.policy.features_extractor
    began = weights(load_network(start / MODEL))
    value = weights(model.policy.value_net)
    assert same(weights(extractor.network), began)
    learn(model, ROLLOUT, seed=0)
    assert same(weights(extractor.network), began)
    assert not same(weights(model.policy.value_net), value)
    learn(model, ROLLOUT + 1, seed=1)
    assert not same(weights(extractor.network), began)
    assert same(weights(model.anchor.network), began)


def test_the_divergence_holds_the_policy(config: TrainConfig, tmp_path: Path) -> None:
    found = []
    for kl in (0.0, 100.0):
        start = config.start.model_copy(update={"kl": kl})  # type: ignore[union-attr]
        model = learner(config.model_copy(update={"start": start}), tmp_path / f"{kl}")
        for number in (1, 2):
            learn(model, ROLLOUT + number, seed=number)
        found.append(model.logger.name_to_value["start/kl"])
        assert model.logger.name_to_value["start/kl_weight"] == pytest.approx(kl, rel=0.05)
    assert 0 < 2 * found[1] < found[0]


def test_a_checkpoint_goes_on_as_if_unbroken(config: TrainConfig, tmp_path: Path) -> None:
    run = tmp_path / "run"
    model = learner(config, run)
    setattr(model, KEPT, {"near_goal": {"single_pickup": [3, [True]]}})
    for number in range(3):
        learn(model, (number + 1) * ROLLOUT, seed=number)
    save(model, run)
    again = write_untrained_run(config, tmp_path / "again", steps=0)
    restore(run / MODEL, again)
    again.set_logger(Logger(None, []))
    assert again.num_timesteps == 3 * ROLLOUT
    assert getattr(again, KEPT) == getattr(model, KEPT)
    assert same(weights(again.anchor), weights(model.anchor))
    for each in (model, again):
        learn(each, 4 * ROLLOUT, seed=3)
    assert same(weights(again.policy), weights(model.policy))
    assert again.logger.name_to_value["start/kl"] == model.logger.name_to_value["start/kl"] > 0


class Stop(BaseCallback):
    """Presses Ctrl-C after so many steps."""

    def _on_step(self) -> bool:
        if self.num_timesteps > 3 * ROLLOUT:
            raise KeyboardInterrupt
        return True


def test_a_run_that_is_stopped_goes_on(config: TrainConfig, start: Path, tmp_path: Path) -> None:
    """It knows its start when that is gone; positions and weights go on where they were."""
    run, total = tmp_path / "run", 5 * ROLLOUT
    bathroom = [task for task in load_suite("mini").tasks if task.scene == "FloorPlan430"]
    write_tasks(tasks := tmp_path / "tasks.jsonl", bathroom)
    env = {"episodes": str(tasks), "types": ["single_pickup"], "max_steps": 12}
    near = {"types": ["single_pickup"], "share": 1.0, "first": 1, "further_at": 0.0,
            "nearer_below": 0.0, "over": 1}  # fmt: skip
    config = TrainConfig.model_validate(
        {**config.model_dump(), "env": env, "near_goal": near, "total_steps": total}
    )
    with pytest.raises(KeyboardInterrupt):
        train(config, run, more=(Stop(),))
    stopped: Any = load_last_checkpoint(run)
    position = getattr(stopped, KEPT)["near_goal"]["single_pickup"][0]
    assert position > 1  # any result moves it away
    (start / MODEL).rename(start / "gone")
    try:
        model: Any = train(config, run)
    finally:
        (start / "gone").rename(start / MODEL)
    assert same(weights(model.anchor), weights(stopped.anchor))
    assert getattr(model, KEPT)["near_goal"]["single_pickup"][0] >= position
    curve = read_curve(run)
    assert [line["steps"] for line in curve] == [ROLLOUT * each for each in range(1, 6)]
    # Each update is logged with the next rollout: the first is the value function's.
    assert config.start is not None
    assert [line["start/kl_weight"] for line in curve[1:]] == pytest.approx(
        [0.0, *(config.start.kl_weight(ROLLOUT * each) for each in (2, 3, 4))]
    )
    assert [line["near_goal/key_actions_left/single_pickup"] for line in curve] == sorted(
        line["near_goal/key_actions_left/single_pickup"] for line in curve
    )
    # The policy plays like any other.
    assert load_network(run / MODEL).width == 16


def test_a_start_that_does_not_fit_is_one_clear_error(
    make_config: Any, start: Path, tmp_path: Path
) -> None:
    for name, why in (
        ("zoo:nobody", "there is no model 'nobody' in the zoo"),
        ("zoo:er-tiny-text", "start.policy zoo:er-tiny-text: there is no trained model"),
        (str(tmp_path), "there is no trained model"),
        ("zoo:all", "start.policy zoo:all observes something else .* take env .* from "),
    ):
        with pytest.raises(ValueError, match=why):
            train(make_config(start={"policy": name}), tmp_path / "run")
        assert not (tmp_path / "run").exists()
    with pytest.raises(ValueError, match="two ways to begin: leave one out"):
        make_config(start={"policy": "zoo:all"}, warm_start={})
    with pytest.raises(ValueError, match="start goes with ppo, not with dqn"):
        make_config(start={"policy": "zoo:all"}, algorithm={"name": "dqn"})


def test_how_it_was_learnt(config: TrainConfig, start: Path) -> None:
    assert (
        how_learnt(config, 256) == f"the weights of {start}, then 256 steps of MaskablePPO on state"
    )
