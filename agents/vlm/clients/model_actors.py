"""Runs copies of a local model in Ray actors, on the cluster's GPUs or processors."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import ray
from ray.exceptions import RayError, RayTaskError

from agents.vlm.chat import Message, ModelError, Reply
from agents.vlm.clients.supervisor import AGAIN, RequestSupervisor
from agents.vlm.settings import AgentSettings
from agents.vlm.tuned_model import named_model
from er_gym.rollout.agent import CannotGoOn
from er_gym.rollout.cluster.actors import start_actor

_RESTARTS = 3
"""Ray starts an actor again so often, and asks it again what it had not answered."""
_LOOK_SECONDS = 0.5


class ModelActors:
    """``settings.local.actors`` copies of a model, each a :class:`.local.LocalClient` in an actor.

    A conversation stays with one copy, which keeps what it computed for earlier turns; a new one
    goes to the copy with the fewest requests under way. If a copy dies, Ray starts another, and
    requests are sent again: with the same seed, a reply is the same.

    Args:
        path: as :class:`.local.LocalClient` takes it; the nodes with the copies must see it.
        settings: the agent's settings.
        supervisor: the run's; waiting for a reply ends when its minutes are over.

    Attributes:
        identity: as :class:`.local.LocalClient` has it.

    Raises:
        ValueError: this process has joined no Ray cluster, or the model cannot be loaded.
    """

    def __init__(
        self, path: str, settings: AgentSettings, supervisor: RequestSupervisor | None = None
    ) -> None:
        if not ray.is_initialized():
            raise ValueError("local.actors needs a cluster: give --executor ray")
        local = settings.local
        self._supervisor = supervisor or RequestSupervisor()
        options = {
            "num_cpus": local.actor_cpus,
            "num_gpus": local.actor_gpus,
            "max_concurrency": 2 * local.batch,
            "max_restarts": _RESTARTS,
            "max_task_retries": _RESTARTS,
        }
        self._actors = [
            start_actor(ModelActor, options, path, settings) for _ in range(local.actors)
        ]
        self._lock = threading.Lock()
        self._busy = [0] * local.actors
        self._own = threading.local()  # a conversation is a thread's
        try:
            self.identity: str = ray.get([each.identity.remote() for each in self._actors])[0]
        except RayError as error:
            self.close()
            raise ValueError(_why(error)) from None

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The model's next turn.

        Raises:
            ModelError, CannotGoOn: as :meth:`.local.LocalClient.reply` raises them.
        """
        start = time.monotonic()
        copy = self._copy(is_new=all(each.role != "assistant" for each in messages))
        try:
            ref = self._actors[copy].reply.remote(list(messages), seed)
            while not ray.wait([ref], timeout=_LOOK_SECONDS)[0]:
                if self._supervisor.over:
                    raise CannotGoOn(f"the minutes are over; {AGAIN}")
            reply: Reply = ray.get(ref)
        except RayTaskError as error:
            if isinstance(error.cause, (ModelError, CannotGoOn)):
                raise error.cause from None
            raise ModelError(_why(error)) from None
        except RayError as error:
            raise CannotGoOn(f"a copy of the model is gone: {_why(error)}") from None
        finally:
            with self._lock:
                self._busy[copy] -= 1
        return replace(reply, seconds=time.monotonic() - start)

    def close(self) -> None:
        """Release the copies; waiting callers get CannotGoOn."""
        for each in self._actors:
            ray.kill(each, no_restart=True)

    def _copy(self, is_new: bool) -> int:
        """Which copy answers this thread's conversation."""
        with self._lock:
            copy: int | None = getattr(self._own, "copy", None)
            if is_new or copy is None:
                copy = self._own.copy = min(range(len(self._busy)), key=self._busy.__getitem__)
            self._busy[copy] += 1
            return copy


class ModelActor:
    """A copy of the model, in an actor. Its methods run in several threads at once."""

    def __init__(self, path: str, settings: AgentSettings) -> None:
        named_model(path)  # before the seconds in which torch is imported
        from agents.vlm.clients.local import LocalClient

        self._client = LocalClient(path, settings)

    def identity(self) -> str:
        """See :class:`.local.LocalClient`."""
        return self._client.identity

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """See :class:`.local.LocalClient`."""
        return self._client.reply(messages, seed)


def _why(error: Any) -> str:
    """What an actor raised, or why it died, in one line."""
    cause = getattr(error, "cause", None)
    text = f"{cause}" if cause is not None else str(error).strip().splitlines()[-1]
    return " ".join(text.split())[:300]
