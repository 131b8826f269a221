"""A worker process that steps several environments one after the other.

It imports no torch: a worker starts in a second and stays small. Several environments share one
process because the engine caches its results about a room per process, and because one message then
carries a batch.
"""

from __future__ import annotations

import contextlib
import gc
import os
import traceback
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from agents.rl.policy_observation import Obs
from er_gym.envs.vector import EmbodiedVectorEnv


class StepBatch(NamedTuple):
    """The results of k environments: arrays of k rows.

    Attributes:
        obs: by the observation's keys, (k, …); after the end of an episode, the first of the next.
        rewards: (k,) float32.
        dones: (k,) bool.
        masks: (k, A) int8, the actions that are legal now.
        infos: k small dictionaries: of an episode that has ended its ``is_success``, ``task_type``,
            ``end_reason``, ``started_at`` and ``terminal_observation``, otherwise empty.
    """

    obs: Obs
    rewards: NDArray[np.float32]
    dones: NDArray[np.bool_]
    masks: NDArray[np.int8]
    infos: list[dict[str, Any]]


class WorkerEnvs:
    """The environments of this process, as one vector environment."""

    def __init__(self, make: Sequence[Callable[[], gymnasium.Env[Any, Any]]]) -> None:
        self.envs = [each() for each in make]
        # The batches are sent, or copied into the learner's buffer, before the next step.
        self._vector = EmbodiedVectorEnv.around(self.envs, AutoresetMode.SAME_STEP, copy=False)

    def reset(self, seeds: Sequence[int | None]) -> StepBatch:
        """Begin an episode in each."""
        obs, info = self._vector.reset(seed=seeds)
        nothing = np.zeros(len(self.envs), np.float32)
        return StepBatch(
            obs, nothing, nothing.astype(bool), info["action_mask"], [{} for _ in self.envs]
        )

    def step(self, actions: NDArray[np.intp]) -> StepBatch:
        """Do one action in each; where an episode ends, the next begins."""
        obs, rewards, terminated, truncated, info = self._vector.step(actions)
        dones = terminated | truncated
        told: list[dict[str, Any]] = [{} for _ in self.envs]
        for row in np.flatnonzero(dones).tolist():
            final = info["final_info"]
            told[row] = {
                "terminal_observation": info["final_obs"][row],
                "TimeLimit.truncated": bool(truncated[row] and not terminated[row]),
                "is_success": bool(final["success"][row]),
                "task_type": final["task_type"][row],
                "end_reason": final["end_reason"][row],
                "started_at": int(final["started_at"][row]),
            }
        return StepBatch(obs, rewards.astype(np.float32), dones, info["action_mask"], told)

    def call(self, name: str, rows: Sequence[int], args: Any, kwargs: Any) -> list[Any]:
        """Call a method of some environments, wherever it is in their wrappers."""
        return [self.envs[row].get_wrapper_attr(name)(*args, **kwargs) for row in rows]

    def get(self, name: str, rows: Sequence[int]) -> list[Any]:
        """An attribute of some environments.

        Raises:
            AttributeError: they have no such attribute.
        """
        return [self.envs[row].get_wrapper_attr(name) for row in rows]

    def set(self, name: str, rows: Sequence[int], value: Any) -> None:
        """Set an attribute of some."""
        for row in rows:
            self.envs[row].set_wrapper_attr(name, value)

    def spaces(self) -> tuple[Any, Any]:
        """Their observation and action space."""
        return self.envs[0].observation_space, self.envs[0].action_space

    def close(self) -> None:
        """Close them."""
        self._vector.close()


def serve(pipe: Connection, make: Sequence[Callable[[], gymnasium.Env[Any, Any]]]) -> None:
    """Answer ``(method of WorkerEnvs, arguments)`` with ``(error or None, result)``, until
    ``close`` is called or the pipe is closed. An error's result is where it was raised, in words,
    since a pickle of it does not hold that."""
    # With SCHED_BATCH a woken worker does not preempt the trainer. Otherwise, with as many workers
    # as cores, the other workers would wait for their actions until it is done.
    with contextlib.suppress(AttributeError, OSError):  # not everywhere, nor always allowed
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    envs: WorkerEnvs | None = None
    try:
        while True:
            method, args = pipe.recv()
            try:
                if envs is None:
                    envs = WorkerEnvs(make)
                answer: tuple[Exception | None, Any] = (None, getattr(envs, method)(*args))
            except Exception as error:  # every error is sent to the trainer
                answer = (error, traceback.format_exc())
            pipe.send(answer)
            if method == "reset":
                # The rooms stay, and are a hundred times as much as a step leaves behind. Without
                # this, looking for garbage among them takes a twentieth of the time.
                gc.freeze()
            if method == "close":
                return
    except (EOFError, BrokenPipeError, ConnectionResetError):
        if envs is not None:
            envs.close()
