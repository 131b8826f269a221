"""A worker on a cluster's node that holds environments of agents in the driver."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Mapping, Sequence
from typing import Any

import ray
from ray.exceptions import RayError

from er_gym.rollout.cluster.actor_pool import (
    ActorOptions,
    first_line,
    is_nodes_fault,
    waiting_message,
)
from er_gym.rollout.cluster.actors import Begun, EnvActor, start_actor
from er_gym.rollout.cluster.origin import Origin
from er_gym.rollout.env_worker import EnvLost
from er_gym.rollout.worker_pool import WorkerSetupError

_TELL_SECONDS = 15.0


class RayEnvWorker:
    """See :class:`er_gym.rollout.env_worker.EnvWorker`.

    Args:
        options: of its actor.
        slots, env: as :class:`~er_gym.rollout.env_worker.LocalEnvWorker` takes them.
    """

    def __init__(self, options: ActorOptions, slots: Sequence[int], env: Mapping[str, Any]) -> None:
        self._options = options
        self._actor = start_actor(EnvActor, options.ray_options)
        self._beginning = self._actor.begin.remote(Origin.here(), [*slots], dict(env))
        self._lock = threading.Lock()
        self._asked: deque[tuple[int, Any]] = deque()
        self._culprit: int | None = None
        self._lost: EnvLost | None = None

    @property
    def alive(self) -> bool:
        return self._lost is None

    def ask(self, slot: int, request: bytes, deadline: float) -> bytes:
        self._wait_for_place()
        with self._lock:
            asked = (slot, self._actor.answer.remote(slot, request))
            self._asked.append(asked)
        try:
            ready, _ = ray.wait([asked[1]], timeout=deadline)
            if not ready:
                raise self._gone(slot, f"no answer within {deadline:g} s", nodes_fault=False)
            answer: bytes = ray.get(asked[1])
        except RayError as error:
            raise self._gone(slot, first_line(error), is_nodes_fault(error)) from None
        finally:
            with self._lock:
                self._asked.remove(asked)
        return answer

    def dismiss(self) -> None:
        ray.kill(self._actor, no_restart=True)

    def end(self) -> EnvLost:
        self.dismiss()
        self._lost = self._lost or EnvLost(None, at_fault=False, why="the worker was ended")
        return self._lost

    def _wait_for_place(self) -> None:
        """Wait until the cluster has a place for the actor."""
        while not ray.wait([self._beginning], timeout=_TELL_SECONDS)[0]:
            self._options.say(waiting_message(1, self._options.ray_options))
        try:
            begun: Begun = ray.get(self._beginning)
        except RayError as error:
            if getattr(error, "actor_init_failed", False):
                raise WorkerSetupError(first_line(error)) from None
            raise self._gone(-1, first_line(error), nodes_fault=True) from None
        if begun.problem:
            raise WorkerSetupError(begun.problem)

    def _gone(self, slot: int, why: str, nodes_fault: bool) -> EnvLost:
        """The actor is gone, or is ended because it is stuck. It answers in the order in which it
        was asked, so the oldest request is the one that it was at."""
        with self._lock:
            if self._lost is None:
                self._culprit = self._asked[0][0] if self._asked else slot
                self._lost = EnvLost(None, at_fault=False, why=why)
                self.dismiss()
        return EnvLost(None, at_fault=not nodes_fault and self._culprit == slot, why=why)
