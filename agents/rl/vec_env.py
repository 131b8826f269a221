"""A Stable-Baselines3 VecEnv with environments in worker processes."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from agents.rl.vec_worker import StepBatch, serve
from er_gym.rollout.processes import CONTEXT, end_processes, start_process

_CLOSING = 5.0
"""Seconds that a worker has to close before it is killed."""


class WorkerVecEnv(VecEnv):
    """Like ``SubprocVecEnv``, with several environments per process, and masks sent with
    observations.

    ``SubprocVecEnv`` works too; this class is faster. With 32 environments in two processes, each
    process answers with one batch, its environments share the engine's caches of a room, and action
    masks come with the observations rather than by another request.

    Args:
        make: one factory per environment, called with ``share=(index, count)`` of its process;
            factories must be picklable.
        workers: the number of processes; they are spawned and import no torch.

    Raises:
        RuntimeError: a worker process died; at any method.
    """

    def __init__(
        self, make: Sequence[Callable[..., gymnasium.Env[Any, Any]]], workers: int = 2
    ) -> None:
        workers = min(workers, len(make))
        self._rows = np.array_split(np.arange(len(make)), workers)
        self._pipes, self._processes = [], []
        for worker, rows in enumerate(self._rows):
            ours, theirs = CONTEXT.Pipe()
            mine = [partial(make[row], share=(worker, workers)) for row in rows]
            process = start_process(serve, theirs, mine)
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        self._closed = False
        self._masks: NDArray[np.int8]
        observation_space, action_space = self._ask("spaces")[0]
        super().__init__(len(make), observation_space, action_space)

    # -- stepping --------------------------------------------------------------------------------

    def reset(self) -> Any:
        """Begin an episode in every environment; (n, …) observations."""
        seeds = [[self._seeds[row] for row in rows] for rows in self._rows]
        for worker, each in enumerate(seeds):
            self._send(worker, "reset", each)
        self._reset_seeds()
        self._reset_options()
        obs, *_ = self._concatenated(self._all_answers())
        return obs

    def step_async(self, actions: NDArray[np.intp]) -> None:
        """Send the actions."""
        for worker, rows in enumerate(self._rows):
            self._send(worker, "step", actions[rows])

    def step_wait(self) -> VecEnvStepReturn:
        """Wait for the results."""
        answers = self._all_answers()
        return self._concatenated(answers)

    def _concatenated(self, batches: Sequence[StepBatch]) -> VecEnvStepReturn:
        self._masks = np.concatenate([batch.masks for batch in batches])
        obs = {key: np.concatenate([batch.obs[key] for batch in batches]) for key in batches[0].obs}
        rewards = np.concatenate([batch.rewards for batch in batches])
        dones = np.concatenate([batch.dones for batch in batches])
        return obs, rewards, dones, [info for batch in batches for info in batch.infos]

    def action_masks(self) -> NDArray[np.int8]:
        """(n, A) int8: the legal actions, as they came with the last observations."""
        return self._masks

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of some environments (None for all); one result each."""
        if method_name == "action_masks":  # as sb3-contrib asks at every step
            return list(self._masks[list(self._get_indices(indices))])
        return self._ask_some(indices, lambda rows: ("call", method_name, rows, args, kwargs))

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of some environments (None for all)."""
        if attr_name == "action_masks":
            return [self.action_masks] * len(list(self._get_indices(indices)))
        return self._ask_some(indices, lambda rows: ("get", attr_name, rows))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of some environments (None for all)."""
        self._ask_some(indices, lambda rows: ("set", attr_name, rows, value))

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """Always False: the environments have none of Stable-Baselines3's wrappers."""
        return [False] * len(list(self._get_indices(indices)))

    def close(self) -> None:
        """End the worker processes."""
        if self._closed:
            return
        self._closed = True
        for pipe in self._pipes:
            with contextlib.suppress(OSError):
                pipe.send(("close", ()))
        for process, pipe in zip(self._processes, self._pipes, strict=True):
            deadline = time.monotonic() + _CLOSING
            with contextlib.suppress(EOFError, OSError):
                # Drain the pipe, so that the worker does not block on a send.
                while process.is_alive() and time.monotonic() < deadline:
                    if pipe.poll(0.05):
                        pipe.recv()
            end_processes([process], grace=0.5)
            pipe.close()

    # -- talking to the workers ------------------------------------------------------------------

    def _ask(self, method: str, *args: Any) -> list[Any]:
        for worker in range(len(self._pipes)):
            self._send(worker, method, *args)
        return self._all_answers()

    def _ask_some(
        self, indices: VecEnvIndices, question: Callable[[list[int]], tuple[Any, ...]]
    ) -> list[Any]:
        """Ask the workers that hold some environments; results in the order of ``indices``."""
        wanted = list(self._get_indices(indices))
        answers: dict[int, Any] = {}
        asked = []
        for worker, rows in enumerate(self._rows):
            mine = [row for row in wanted if row in rows]
            if mine:
                self._send(worker, *question([row - int(rows[0]) for row in mine]))
                asked.append((worker, mine))
        for worker, mine in asked:
            answers |= zip(mine, self._answer(worker) or [None] * len(mine), strict=True)
        return [answers[row] for row in wanted]

    def _send(self, worker: int, method: str, *args: Any) -> None:
        try:
            self._pipes[worker].send((method, args))
        except OSError:
            raise self._dead(worker) from None

    def _all_answers(self) -> list[Any]:
        return [self._answer(worker) for worker in range(len(self._pipes))]

    def _answer(self, worker: int) -> Any:
        try:
            error, answer = self._pipes[worker].recv()
        except (EOFError, OSError):
            raise self._dead(worker) from None
        if error is not None:
            raise error from RuntimeError(f"in worker process {worker + 1}:\n\n{answer}")
        return answer

    def _dead(self, worker: int) -> RuntimeError:
        self._processes[worker].join(_CLOSING)
        code = self._processes[worker].exitcode
        return RuntimeError(
            f"worker process {worker + 1} of {len(self._pipes)} died with exit code {code}; "
            "the same command continues from the last checkpoint"
        )
