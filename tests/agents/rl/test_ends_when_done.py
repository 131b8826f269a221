"""``env.ends_when_done``: a policy that does not give up while it has steps left."""

from __future__ import annotations

from functools import partial
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
from agents.rl.vec_env import WorkerVecEnv
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.info import with_details
from er_gym.tasks import verbs

END = INDEX[Action(verbs.END)]
OPTIONS = EnvConfig(
    episodes="mini", types=("single_pickup",), subtasks=True, ends_when_done=True, max_steps=9
)


def allowed_differs(mask: np.ndarray, legal: np.ndarray) -> list[int]:
    assert not np.any(mask > legal)
    return np.flatnonzero(mask != legal).tolist()


@pytest.mark.parametrize("with_mask", [False, True])
def test_it_may_end_once_it_is_done_or_at_the_last_step(with_mask: bool) -> None:
    env: Any = make_env(OPTIONS, with_mask=with_mask)
    with pytest.raises(ResetNeeded):
        env.action_masks()
    done_early = tried = 0
    env.reset(seed=3)
    for episode in range(12):
        obs, info = env.reset()
        over = False
        while not over:
            told = with_details(env, info)
            done = env.policy_observation.subtasks.progress.at() is None
            last = info["steps"] == info["max_steps"] - 1
            legal = env.unwrapped.action_masks()
            withheld = [] if done or last else [END]
            assert allowed_differs(env.action_masks(), legal) == withheld
            assert np.array_equal(info["action_mask"], env.action_masks())
            if with_mask:
                assert np.array_equal(obs["mask"], env.action_masks())
            done_early += done and not last
            tried += not done
            thing = told["task"].goal[0].object_type
            pickup = Action(verbs.PICKUP, thing)
            number = INDEX[pickup] if legal[INDEX.get(pickup, 0)] else 0
            if episode % 3 or not number:  # it seeks; some leave the thing where it is
                choice = np.flatnonzero(env.action_masks() * (np.arange(len(ACTIONS)) != END))
                goal = INDEX.get(Action(verbs.NAVIGATE, thing), -1)
                number = number or (goal if goal in choice else int(choice[info["steps"]]))
            obs, _, terminated, truncated, info = env.step(number)
            over = terminated or truncated
    assert done_early > 3
    assert tried > 30
    env.close()


def test_processes_send_what_it_may_choose() -> None:
    vec = WorkerVecEnv([partial(make_env, OPTIONS)] * 3, workers=2)
    vec.seed(5)
    vec.reset()
    random, ended = np.random.default_rng(0), 0
    for _ in range(24):
        masks = vec.action_masks()
        ended += int(masks[:, END].sum())
        assert masks.any(axis=1).all()
        masks[:, END] = 0
        vec.step((random.random(masks.shape) * masks).argmax(axis=1))
    assert 0 < ended < 24  # at the last steps only
    vec.close()


def test_an_agent_does_not_give_up(make_config: Any, tmp_path: Path) -> None:
    """Its network would rather end at once."""
    config = make_config(env=OPTIONS.model_dump(exclude={"max_steps"}))
    write_untrained_run(config, tmp_path / "run")
    agent = RLAgent(tmp_path / "run")
    network = load_network(tmp_path / "run" / MODEL)
    with torch.no_grad():
        network.bare.bias[verbs.BARE_VERBS.index(verbs.END)] = 1e6
    agent._policy._network = network
    env: Any = make_env(config.env)
    env.reset(seed=2)
    _, info = env.reset()
    agent.reset(env.unwrapped.task, info["seen"], with_details(env, info))
    names, over = [], False
    while not over:
        decided = agent.act(info["seen"], with_details(env, info))
        names.append(decided.action.verb)  # type: ignore[union-attr]
        _, _, terminated, truncated, info = env.step(INDEX[decided.action])  # type: ignore[index]
        over = terminated or truncated
    assert verbs.END not in names[:-1]
    assert len(names) > 3
    env.close()


def test_it_is_about_subtasks() -> None:
    with pytest.raises(ValidationError, match="give subtasks=true, too"):
        EnvConfig(ends_when_done=True)
