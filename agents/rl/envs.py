"""Training environments. Imports no torch, since worker processes make them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from agents.rl.adviser import Adviser
from agents.rl.config import EnvConfig
from agents.rl.demonstrations import Demonstrations, demonstrate
from agents.rl.near_goal import (
    MOMENT,
    Moment,
    StartsWithin,
    demonstrated,
    demonstrations_of,
    moment_at,
)
from agents.rl.policy_observation import Obs, PolicyObservation
from agents.rl.rewards import with_reward
from er_gym.envs.actions import ACTIONS, INDEX
from er_gym.envs.embodied_env import verification_env
from er_gym.envs.sources import EpisodeSource, TaskList, make_source
from er_gym.envs.vector.member import MemberEnv
from er_gym.envs.wrappers import KeyActionShaping
from er_gym.tasks.types import TaskType, types_named

_IN_EVALUATION = {
    "key_actions": 1.0,
    **dict.fromkeys(("step_penalty", "illegal_penalty", "success_bonus", "shaping", "faults"), 0.0),
    "reward": "",
}
"""The fields of training only, each with its value in evaluation, which changes nothing."""
ADVICE = "advice"
"""The key of an advised environment's observation."""


class TrainingRules(gymnasium.Wrapper[Any, Any, Any, Any]):
    """The step limit terminates an episode; key actions and success earn what training says.

    The step limit is part of the task, and the observation states how near it is. No reward follows
    beyond it, so the value there must be 0.
    """

    looks_after_step = True

    def __init__(
        self, env: gymnasium.Env[Any, Any], success_bonus: float, key_actions: float
    ) -> None:
        super().__init__(env)
        self._bonus, self._more = success_bonus, key_actions - 1.0  # the environment gives 1
        self._done = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._done = info["key_actions_done"]
        return obs, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Do an action."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        before, self._done = self._done, info["key_actions_done"]
        reward += self._bonus * info["success"] + self._more * (self._done - before)
        return obs, reward, terminated or truncated, False, info


class LearningEnv(gymnasium.Wrapper[dict[str, Any], Any, Any, Any]):
    """Draws tasks of the given types, and returns what :class:`PolicyObservation` makes of them.

    ``info["started_at"]`` is the position at which the episode started near its goal, 0 for an
    episode from the beginning.

    Args:
        env: an ``EmbodiedEnv``, shaped or not.
        source: draws the tasks.
        types: the task types, drawn with equal probability; any type if empty.
        policy_observation: makes the learner's observations.
        options: whose demonstrations are used.
        near: the share of episodes that start near the goal, of types with a position.
    """

    looks_after_step = True

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        source: EpisodeSource,
        types: Sequence[str],
        policy_observation: PolicyObservation,
        options: EnvConfig,
        near: float = 0.0,
    ) -> None:
        super().__init__(env)
        self._mask: NDArray[np.int8] | None = None
        self._near, self._positions = near, dict[str, int]()
        self._started_at = 0
        self._demonstrations = demonstrations_of(options)
        self._source, self.policy_observation = source, policy_observation
        self.set_types(types)
        self._rng = np.random.default_rng()
        self.observation_space = policy_observation.space

    def set_types(self, types: Sequence[str]) -> None:
        """Draw tasks of these types from the next episode on.

        Raises:
            ValueError: a name is not one of a task type or of a group.
        """
        self._types: tuple[TaskType | None, ...] = types_named(types) or (None,)

    def set_positions(self, positions: Mapping[str, int]) -> None:
        """Let episodes start with so many key actions left, by type of task; others start from the
        beginning."""
        self._positions = dict(positions)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Obs, dict[str, Any]]:
        """Begin an episode; its task is drawn unless ``options`` name it, or a moment."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        chosen = options or self._next()
        obs, info = self.env.reset(seed=seed, options=chosen)
        moment: Moment | None = chosen.get(MOMENT)
        position = 0 if moment is None else moment.left
        self._started_at = position and self._positions.get(info["task_type"], position)
        info |= {"seen": obs, "started_at": self._started_at}
        observation = self.policy_observation
        told = observation.info_of(self, info)
        if moment is None:
            seen = observation.reset(obs, told, info["instruction"])
        else:
            observation.recall(moment.memory)
            seen = observation.observe(obs, told)
        return seen, self._with_choice(info)

    def _next(self) -> dict[str, Any]:
        """The options of the next episode: its task, or where it starts near its goal."""
        kind = self._types[int(self._rng.integers(len(self._types)))]
        task = self._source.draw(self._rng, kind, None)
        position = self._positions.get(task.type.name)
        if position is None or self._rng.random() >= self._near:
            return {"task": task}
        own: Any = self.unwrapped
        moments = self._demonstrations.of(
            task, lambda: demonstrated(own, self.policy_observation, task)
        )
        moment = moment_at(moments, position)
        return {"task": task} if moment is None else {MOMENT: moment}

    def step(self, action: Any) -> tuple[Obs, Any, bool, bool, dict[str, Any]]:
        """Do an action."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        info |= {"seen": obs, "started_at": self._started_at}
        seen = self.policy_observation.observe(obs, self.policy_observation.info_of(self, info))
        return seen, reward, terminated, truncated, self._with_choice(info)

    def _with_choice(self, info: dict[str, Any]) -> dict[str, Any]:
        """``info`` whose mask has the actions between which the learner chooses."""
        self._mask = info["action_mask"] = self.policy_observation.allowed(info)
        return info

    def action_masks(self) -> NDArray[np.int8]:
        """(A,) int8, not 0 for the legal actions between which the learner chooses now.

        Raises:
            ResetNeeded: no episode has begun.
        """
        if self._mask is None:
            own: Any = self.unwrapped
            own.action_masks()  # raises it
        assert self._mask is not None
        return self._mask

    def demonstrate(self, *asked: Any) -> Demonstrations:
        """See :func:`agents.rl.demonstrations.demonstrate`; for ``make_env(with_text=True)``."""
        return demonstrate(self, *asked)

    def close(self) -> None:
        """Close the environment and the source."""
        super().close()
        getattr(self._source, "close", lambda: None)()


class AdvisedEnv(gymnasium.Wrapper[Obs, Any, Obs, Any]):
    """Adds the action that the searcher would take to the observation of a :class:`LearningEnv`
    with subtasks: ``advice``, () int64, the index of its action."""

    looks_after_step = True
    env: LearningEnv

    def __init__(self, env: LearningEnv) -> None:
        super().__init__(env)
        self._adviser = Adviser()
        entries = cast(spaces.Dict, env.observation_space).spaces
        advice = spaces.Box(0, len(ACTIONS) - 1, (), np.int64)
        space: Any = spaces.Dict({**entries, ADVICE: advice})
        self.observation_space = space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Obs, dict[str, Any]]:
        """Begin an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        memory = self.env.policy_observation.subtasks
        assert memory is not None  # make_env sees to it
        self._adviser.begin(self.unwrapped.task, info, memory)  # type: ignore[attr-defined]
        return self._advised(obs, info), info

    def step(self, action: Any) -> tuple[Obs, Any, bool, bool, dict[str, Any]]:
        """Do an action."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        return self._advised(obs, info), reward, terminated, truncated, info

    def _advised(self, obs: Obs, info: dict[str, Any]) -> Obs:
        return {**obs, ADVICE: np.array(INDEX[self._adviser.advise(info)])}


def make_env(
    options: EnvConfig,
    gamma: float = 1.0,
    with_mask: bool = False,
    with_text: bool = False,
    advised: bool = False,
    near: float = 0.0,
    share: tuple[int, int] = (0, 1),
) -> gymnasium.Env[Obs, Any]:
    """Make a training environment.

    Args:
        options: the episodes, observations and reward.
        gamma: the learner's discount, for shaping.
        with_mask: whether the observation holds the action mask.
        with_text: whether ``info["seen"]``, the environment's own observation, holds text, which
            scripted agents need.
        advised: whether the observation holds the searcher's advice; for options with subtasks.
        near: the share of episodes that start near their goal (:class:`LearningEnv`).
        share: ``(index, count)`` of the worker process; each plays in its own rooms.

    Raises:
        ValueError: the suite, the encoder or the reward wrapper does not exist.
        TaskFileError: the suite has not been built, or its file is damaged. (It is a ValueError.)
    """
    member = MemberEnv(
        (),
        obs_mode=f"{options.needed_obs_mode}+text" if with_text else options.needed_obs_mode,
        width=options.width,
        height=options.height,
        instances=options.instances,
        step_penalty=options.step_penalty,
        illegal_penalty=options.illegal_penalty,
        faults=options.faults,
        max_steps=options.max_steps,
    )
    env: gymnasium.Env[Any, Any] = TrainingRules(
        StartsWithin(member), options.success_bonus, options.key_actions
    )
    if options.shaping:
        env = KeyActionShaping(env, gamma, options.shaping)
    env = with_reward(env, options.reward)
    source = make_source(options.episodes, verification_env)
    if isinstance(source, TaskList):
        source = source.share(*share)
    observation = PolicyObservation(options, with_mask)
    learning = LearningEnv(env, source, options.types, observation, options, near)
    return AdvisedEnv(learning) if advised else learning


def evaluation_config(options: EnvConfig, episodes: str) -> EnvConfig:
    """The same configuration for other episodes, with the environment's own reward and no
    faults."""
    return options.model_copy(update={"episodes": episodes, **_IN_EVALUATION})
