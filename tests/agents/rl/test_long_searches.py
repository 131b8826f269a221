"""``long_searches``: episodes that go on where the policy's own had searched for long."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from pydantic import ValidationError

from agents.rl.config import EnvConfig
from agents.rl.envs import make_env
from agents.rl.guidance import LongSearches
from agents.rl.near_goal import LONG_SEARCH
from er_gym.envs.actions import ACTIONS
from er_gym.envs.vector import EmbodiedVectorEnv
from er_gym.tasks import verbs

OPTIONS = EnvConfig(
    episodes="mini", subtasks=True, sightings=True, object_map=True, shaping=1.0, faults=0.1
)
AFTER = 4


def choices(mask: np.ndarray) -> np.ndarray:
    """The legal actions, but for ``end``."""
    return np.array([n for n in np.flatnonzero(mask) if ACTIONS[n].verb != verbs.END])


def test_what_is_kept_goes_on_as_the_episode_would(monkeypatch: pytest.MonkeyPatch) -> None:
    """Side by side in one vector environment, as in training."""
    long = LongSearches(share=0.0, after=AFTER, kept=3)
    envs: list[Any] = [make_env(OPTIONS, 0.99, long=long) for _ in range(3)]
    vector = EmbodiedVectorEnv.around(envs, AutoresetMode.SAME_STEP, copy=True)
    random = np.random.default_rng(0)
    obs, info = vector.reset(seed=4)
    actions: list[list[int]] = [[] for _ in envs]
    then: list[list[Any]] = [[] for _ in envs]
    kept, checked = [0] * 3, 0
    for _ in range(60):
        chosen = [int(random.choice(choices(mask))) for mask in info["action_mask"]]
        before = [len(env._searches) for env in envs]
        obs, rewards, ends, others, info = vector.step(chosen)
        for row, env in enumerate(envs):
            if ends[row] or others[row]:
                then[row], actions[row] = [], []
                continue
            if len(env._searches) > before[row]:
                kept[row] += 1
                assert env.policy_observation.subtasks.since == AFTER
                assert info["started_at"][row] == 0
                then[row] = [({name: each[row] for name, each in obs.items()}, None)]
                actions[row] = []
            elif then[row]:
                actions[row].append(chosen[row])
                seen = {name: each[row] for name, each in obs.items()}
                then[row].append((seen, rewards[row]))
                if len(then[row]) == 4 and checked < 8:
                    check(then[row], actions[row], env._searches[-1])
                    checked += 1
    assert checked > 3
    assert max(kept) >= 3 == max(len(env._searches) for env in envs)
    vector.close()


def check(then: list[Any], actions: list[int], moment: Any) -> None:
    """Another environment goes on from a kept state, and meets the same."""
    other: Any = make_env(OPTIONS, 0.99, long=LongSearches(share=1.0, after=AFTER))
    other._searches.append(moment)
    obs, info = other.reset(seed=1)
    assert info["started_at"] == LONG_SEARCH
    found = [(obs, None)]
    for action in actions:
        obs, reward, *_ = other.step(action)
        found.append((obs, reward))
    for (one, gained), (seen, reward) in zip(then, found, strict=True):
        assert one.keys() == seen.keys()
        for name in one:
            assert np.array_equal(one[name], seen[name]), name
        assert gained is reward is None or gained == pytest.approx(reward)
    other.close()


def test_only_episodes_from_their_beginning_are_kept() -> None:
    """In an episode that goes on from a kept state, another subtask may take long, too."""
    env: Any = make_env(OPTIONS, long=LongSearches(share=1.0, after=AFTER))
    random, later = np.random.default_rng(2), 0
    env.reset(seed=3)
    for _ in range(40):
        _, info = env.reset()
        began, kept, over = info["started_at"], list(env._searches), False
        while not over:
            _, _, terminated, truncated, info = env.step(
                int(random.choice(choices(info["action_mask"])))
            )
            over = terminated or truncated
            if began and not over and env.policy_observation.subtasks.moved_on:
                env.policy_observation.subtasks.since = 0
                later += 1
            if began and random.random() < 0.2:
                env.policy_observation.subtasks.since = AFTER - 2
                later += 1
        if began:
            assert list(env._searches) == kept
    assert later > 20
    env.close()


def test_so_many_start_so(make_config: Any) -> None:
    env: Any = make_env(OPTIONS, long=LongSearches(share=0.5, after=2))
    random = np.random.default_rng(1)
    env.reset(seed=0)
    starts = []
    for _ in range(60):
        _, info = env.reset()
        starts.append(info["started_at"])
        for _ in range(4):
            _, _, terminated, truncated, info = env.step(
                int(random.choice(choices(info["action_mask"])))
            )
            if terminated or truncated:
                break
    assert set(starts) == {0, LONG_SEARCH}
    assert 15 < starts.count(LONG_SEARCH) < 45
    env.close()


def test_they_are_of_subtasks(make_config: Any) -> None:
    with pytest.raises(ValidationError, match=r"give env\.subtasks=true, too"):
        make_config(long_searches={"share": 0.5})
