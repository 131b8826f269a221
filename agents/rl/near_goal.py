"""Episodes that start within a demonstration, some key actions before its end. Imports no torch.

The searcher does the task once. Wherever it has done another key action, the environment's snapshot
is kept, and what the learner's observation remembers. An episode that starts there goes on from the
snapshot, as if the learner had come that way itself: the steps taken count.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import gymnasium

from agents.rl.config import EnvConfig, TrainConfig
from agents.rl.policy_observation import PolicyObservation
from agents.scripted.searcher import SearcherAgent
from er_gym.envs.embodied_env import EmbodiedEnv, verification_env
from er_gym.envs.info import with_details
from er_gym.envs.sources import TaskList, make_source
from er_gym.rollout.loop import transitions
from er_gym.tasks.splits import rooms_kept_for_evaluation
from er_gym.tasks.task import Task

_MOST = 1024
"""The number of tasks whose demonstrations a process keeps; one takes some 30 kB."""
MOMENT = "moment"
"""The option of ``reset`` that names where to start."""


@dataclass(frozen=True)
class Moment:
    """A state of a demonstration.

    Attributes:
        left: the number of key actions that are left.
        snapshot: of the environment.
        memory: what the learner's observation remembered before it saw this state.
    """

    left: int
    snapshot: bytes
    memory: bytes


class StartsWithin(gymnasium.Wrapper[Any, Any, Any, Any]):
    """``reset(options={"moment": Moment})`` goes back to that state of an episode.

    It is the innermost wrapper, so that all others see an ordinary ``reset``.
    """

    looks_after_step = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode, or go on from a moment."""
        if options is None or MOMENT not in options:
            return self.env.reset(seed=seed, options=options)
        own: Any = self.unwrapped
        obs, info = own.restore(options[MOMENT].snapshot)
        return obs, info


class _Watched:
    """An environment in which each new number of key actions left is kept as a moment."""

    def __init__(self, env: EmbodiedEnv, observation: PolicyObservation) -> None:
        self._env, self._observation = env, observation
        self.moments: list[Moment] = []

    @property
    def unwrapped(self) -> Any:
        return self._env.unwrapped

    def begin(self, task: Task) -> tuple[Any, dict[str, Any]]:
        obs, info = self._env.reset(options={"task": task})
        told = self._observation.info_of(self._env, info)
        self._observation.reset(obs, told, info["instruction"])
        self._left = info["key_actions_left"]
        return obs, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        memory = self._observation.memory()
        obs, reward, terminated, truncated, info = self._env.step(action)
        left, over = info["key_actions_left"], terminated or truncated
        if left < self._left and not over:
            self.moments.append(Moment(left, self._env.snapshot(), memory))
            self._left = left
        self._observation.observe(obs, self._observation.info_of(self._env, info))
        return obs, reward, terminated, truncated, info


def demonstrated(
    env: EmbodiedEnv, observation: PolicyObservation, task: Task
) -> tuple[Moment, ...]:
    """The moments of a task that the searcher does, the farthest from the goal first.

    Args:
        env: is played in; the episode under way is lost.
        observation: the learner's; it forgets its episode.
        task: what is to be done.

    Returns:
        () if the searcher fails.
    """
    watched, agent = _Watched(env, observation), SearcherAgent()
    obs, told = watched.begin(task)
    last: Mapping[str, Any] = (info := with_details(env, told))
    agent.reset(task, obs, info)
    for each in transitions(watched, agent, obs, info):
        last = each.info
    return tuple(watched.moments) if last["success"] else ()


def moment_at(moments: Sequence[Moment], position: int) -> Moment | None:
    """The first moment with at most so many key actions left; None if the demonstration began with
    no more, or there is none."""
    if not moments or moments[0].left < position:
        return None
    return next((each for each in moments if each.left <= position), None)


class Demonstrations:
    """The moments of tasks; each task is demonstrated once, as long as it is kept."""

    def __init__(self) -> None:
        self._kept: OrderedDict[str, tuple[Moment, ...]] = OrderedDict()

    def of(self, task: Task, show: Callable[[], tuple[Moment, ...]]) -> tuple[Moment, ...]:
        """The moments of a task; ``show`` makes them."""
        if task.id not in self._kept:
            self._kept[task.id] = show()
        self._kept.move_to_end(task.id)
        if len(self._kept) > _MOST:
            self._kept.popitem(last=False)
        return self._kept[task.id]


@lru_cache(maxsize=4)
def demonstrations_of(options: EnvConfig) -> Demonstrations:
    """Those of this process, shared by its environments with these options."""
    return Demonstrations()


def check_tasks(config: TrainConfig) -> None:
    """Check that demonstrations show nothing by which the policy is judged.

    Raises:
        ValueError: the tasks play in rooms that are kept for evaluation, or are those of the
            configuration's evaluation.
    """
    name = config.env.episodes
    source = make_source(name, verification_env)
    kept = rooms_kept_for_evaluation(source.tasks) if isinstance(source, TaskList) else []
    if kept or (config.evaluation is not None and name == config.evaluation.episodes):
        why = f"plays in rooms that are kept for evaluation, such as {kept[0]}" if kept else (
            "is the one of evaluation"
        )  # fmt: skip
        raise ValueError(
            f"near_goal demonstrates tasks, and env.episodes {name} {why}; "
            "give env.episodes=train, or leave near_goal out"
        )
