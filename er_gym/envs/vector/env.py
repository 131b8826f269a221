"""The vector environment: n environments in one process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from er_gym.envs.actions import ACTIONS, AnyAction, text_of
from er_gym.envs.arguments import flag, one_of, short_repr, whole_number
from er_gym.envs.embodied_env import verification_env
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.sources import EpisodeSource, Source, make_source
from er_gym.envs.vector.batches import ObservationBatch, batched_infos
from er_gym.envs.vector.group import Group
from er_gym.envs.vector.member import MemberEnv, act_ahead, can_act_ahead

Batch = dict[str, Any]
"""Observations or infos of all environments, by name."""
_MOST = 4096


class EmbodiedVectorEnv(VectorEnv[Batch, Any, NDArray[Any]]):
    """n household environments in one process, which share rooms and what is known about them.

    ``gymnasium.make_vec("ER-SingleSearch-v0", num_envs=64)`` makes one, as does
    ``vectorization_mode="vector_entry_point"``. What it returns equals what
    :class:`gymnasium.vector.SyncVectorEnv` returns over the same environments, to the byte:
    observations in a dictionary of (n, …) arrays, texts as a tuple; ``info`` as a dictionary of
    arrays, such as ``info["action_mask"]``, (n, len(ACTIONS)) int8, each with another,
    ``info["_action_mask"]``, (n,) bool, that says for which environments it holds.

    Args:
        num_envs: n, from 1 to 4096.
        episode_source: see :class:`~er_gym.envs.embodied_env.EmbodiedEnv`; all draw from one.
        autoreset_mode: what ``step`` does with an environment whose episode is over
            (:class:`gymnasium.vector.AutoresetMode`, or its value): ``"NextStep"``, the step after
            begins the next episode and ignores the action; ``"SameStep"``, the step that ends an
            episode begins the next, and ``info`` holds ``final_obs`` and ``final_info``;
            ``"Disabled"``, ``reset(options={"reset_mask": …})`` begins it, (n,) bool.
        copy: whether observations are the caller's own. Without it, the next step changes them.
        max_episode_steps: a ``TimeLimit`` around each environment; None for none.
        arguments: of :class:`~er_gym.envs.embodied_env.EmbodiedEnv`, for each environment.

    Attributes:
        envs: the environments.

    Raises:
        ValueError: an argument does not fit.
    """

    metadata: dict[str, Any]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        episode_source: Source = "mini",
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        max_episode_steps: int | None = None,
        **arguments: Any,
    ) -> None:
        num_envs = whole_number("num_envs", num_envs, 1, _MOST)
        modes = [mode.value for mode in AutoresetMode]
        named = getattr(autoreset_mode, "value", autoreset_mode)
        mode = AutoresetMode(one_of("autoreset_mode", named, modes))
        copy = flag("copy", copy)
        if max_episode_steps is not None:
            max_episode_steps = whole_number("max_episode_steps", max_episode_steps, 1)
        source: EpisodeSource = make_source(episode_source, verification_env)
        self._close_source = getattr(source, "close", lambda: None)
        envs: list[gymnasium.Env[Batch, Any]] = []
        for _ in range(num_envs):
            env: gymnasium.Env[Batch, Any] = MemberEnv(source, **arguments)
            envs.append(TimeLimit(env, max_episode_steps) if max_episode_steps else env)
        self._hold(envs, mode, copy)

    @classmethod
    def around(
        cls, envs: Sequence[gymnasium.Env[Batch, Any]], mode: AutoresetMode, copy: bool = True
    ) -> EmbodiedVectorEnv:
        """A vector environment of environments that are there already, wrapped or not.

        Those of :class:`~er_gym.envs.vector.member.MemberEnv` step together, if all their wrappers
        look at them only after a step (:func:`~er_gym.envs.vector.member.can_act_ahead`).

        Args:
            envs: with the same spaces.
            mode, copy: see :class:`EmbodiedVectorEnv`.
        """
        made = cls.__new__(cls)
        made._close_source = lambda: None
        made._hold(envs, mode, copy)
        return made

    def _hold(
        self, envs: Sequence[gymnasium.Env[Batch, Any]], mode: AutoresetMode, copy: bool
    ) -> None:
        self.envs, self.num_envs = envs, len(envs)
        self._mode, self._copy = mode, copy
        first = envs[0]
        self.metadata = {**first.metadata, "autoreset_mode": mode}
        self.render_mode = first.render_mode
        self.single_action_space = first.action_space
        self.single_observation_space = first.observation_space
        self.action_space = batch_space(first.action_space, self.num_envs)
        self.observation_space = batch_space(first.observation_space, self.num_envs)
        self._batch = ObservationBatch(cast(spaces.Dict, first.observation_space), self.num_envs)
        self._over = np.zeros(self.num_envs, dtype=bool)
        self._group = Group(self.num_envs)
        for row, env in enumerate(envs):
            if can_act_ahead(env):
                cast(MemberEnv, env.unwrapped).join(self._group, row)

    # -- Gymnasium's interface -------------------------------------------------------------------

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Batch, Batch]:
        """Begin an episode in each environment.

        Args:
            seed: of the first, the next has one more, and so on; or a list with one for each.
            options: those of :meth:`EmbodiedEnv.reset`, for each environment; and ``reset_mask``,
                (n,) bool: only these begin one, the others go on.

        Raises:
            ValueError: the seeds are not n, or an option does not fit.
        """
        seeds = self._seeds(seed)
        others = dict(options or {})
        rows = self._chosen(others.pop("reset_mask")) if "reset_mask" in others else None
        rows = list(range(self.num_envs)) if rows is None else rows
        infos = []
        for row in rows:
            obs, info = self.envs[row].reset(
                seed=seeds[row], options=None if options is None else others
            )
            self._over[row] = False
            self._batch.put(row, obs)
            infos.append(info)
        return self._batch.told(self._copy), batched_infos(infos, rows, self.num_envs)

    def step(
        self, actions: NDArray[np.integer[Any]] | Sequence[AnyAction]
    ) -> tuple[Batch, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], Batch]:
        """Do one action in each environment.

        Args:
            actions: (n,) indices; or a list of n indices, actions or texts.

        Returns:
            Observations; (n,) rewards; (n,) whether the episode has terminated, and whether it was
            truncated; infos.

        Raises:
            gymnasium.error.InvalidAction: there are not n actions, or one is none. Nothing has
                changed.
            ResetNeeded: autoreset is disabled, and an episode is over.
        """
        chosen = self._actions(actions)
        n, same_step = self.num_envs, self._mode is AutoresetMode.SAME_STEP
        if self._mode is AutoresetMode.DISABLED and self._over.any():
            over = ", ".join(map(str, np.flatnonzero(self._over)[:10]))
            raise ResetNeeded(
                f"the episodes of environments {over} are over: call reset(options={{'reset_mask': "
                "MASK}) before step()"
            )
        rewards = np.zeros(n)
        terminated, truncated = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        infos: list[Mapping[str, Any]] = []
        ended: list[int] = []
        final_obs, final_infos = np.full(n, None, dtype=object), []
        act_ahead(
            self._group,
            [(self.envs[row], chosen[row]) for row in range(n) if same_step or not self._over[row]],
        )
        for row, env in enumerate(self.envs):
            if self._over[row] and not same_step:
                obs, info = env.reset()
            else:
                obs, rewards[row], terminated[row], truncated[row], info = env.step(chosen[row])
                if same_step and (terminated[row] or truncated[row]):
                    ended.append(row)
                    final_obs[row] = obs
                    final_infos.append(info)
                    obs, info = env.reset()
            self._batch.put(row, obs)
            infos.append(info)
        self._over = terminated | truncated
        told = batched_infos(infos, range(n), n)
        if ended:
            told |= {
                "final_obs": final_obs,
                "_final_obs": self._over.copy(),
                "final_info": batched_infos(final_infos, ended, n),
                "_final_info": self._over.copy(),
            }
        return self._batch.told(self._copy), rewards, terminated, truncated, told

    def action_masks(self) -> NDArray[np.int8]:
        """(n, len(ACTIONS)) int8: 1 for each action that is legal now."""
        return np.stack(self.call("action_masks"))

    def render(self) -> tuple[Any, ...]:
        """What each environment's ``render`` returns."""
        return tuple(env.render() for env in self.envs)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Call a method of each environment, or read an attribute; one result each."""
        found = [env.get_wrapper_attr(name) for env in self.envs]
        return tuple(each(*args, **kwargs) if callable(each) else each for each in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each environment."""
        return self.call(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Set an attribute of each environment.

        Args:
            name: of the attribute.
            values: a list or tuple of n values; or one value for all.

        Raises:
            ValueError: they are not n.
        """
        each = values if isinstance(values, list | tuple) else [values] * self.num_envs
        if len(each) != self.num_envs:
            raise ValueError(f"{len(each)} values of {name!r}; give {self.num_envs}, or one value")
        for env, value in zip(self.envs, each, strict=True):
            env.set_wrapper_attr(name, value)

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generator of each environment."""
        return self.get_attr("np_random")

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """The seed of each environment's random generator."""
        return self.get_attr("np_random_seed")

    def close_extras(self, **kwargs: Any) -> None:
        """Close the environments, and the source if it can be closed."""
        for env in self.envs:
            env.close()
        self._close_source()

    # -- checks ----------------------------------------------------------------------------------

    def _seeds(self, seed: Any) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, Integral):
            return [int(seed) + row for row in range(self.num_envs)]
        seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds for {self.num_envs} environments; give one each")
        return seeds

    def _chosen(self, mask: Any) -> list[int]:
        """The environments that a ``reset_mask`` names."""
        fits = isinstance(mask, np.ndarray) and mask.dtype == bool
        if not fits or mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"option 'reset_mask' at reset is {short_repr(mask)}; give a NumPy array of "
                f"{self.num_envs} Booleans, at least one of them True"
            )
        return [int(row) for row in np.flatnonzero(mask)]

    def _actions(self, actions: Any) -> Sequence[AnyAction]:
        """One action for each environment, all checked."""
        if not isinstance(actions, np.ndarray):
            if not isinstance(actions, list | tuple) or len(actions) != self.num_envs:
                raise self._not_actions(actions)
            for action in actions:
                text_of(action)
            return actions
        if actions.shape != (self.num_envs,) or actions.dtype.kind not in "iu":
            raise self._not_actions(actions)
        wrong = (actions < 0) | (actions >= len(ACTIONS))
        if wrong.any():
            row = int(wrong.argmax())
            raise gymnasium.error.InvalidAction(
                f"the action of environment {row} is {actions[row]}; give an index from 0 to "
                f"{len(ACTIONS) - 1}"
            )
        return actions.tolist()  # type: ignore[no-any-return]

    def _not_actions(self, actions: Any) -> gymnasium.error.InvalidAction:
        shape = getattr(actions, "shape", None)
        given = short_repr(actions) if shape is None else f"{actions.dtype} of shape {shape}"
        return gymnasium.error.InvalidAction(
            f"the actions are {given}; give an array of {self.num_envs} integers, or a list of "
            f"{self.num_envs} actions"
        )
