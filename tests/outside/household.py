"""Another package's additions to er-gym, besides verbs: docs/extending.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium import spaces

from agents.vlm.chat import Message, Reply
from agents.vlm.clients.registry import ModelClientSpec
from er_gym.envs.observations import Observation
from er_gym.rollout.agent import Decision
from er_gym.tasks import Suite, Task, load_suite


class Impatient:
    """Ends at once."""

    obs_mode = "text"

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Nothing is remembered."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Say that it is done."""
        return Decision("end", f"I was made with the seed {self.seed}.")


class Echo:
    """A model that says what it was opened with."""

    def __init__(self, model: str) -> None:
        self.identity = f'{{"echo":"{model}"}}'
        self._model = model

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The same each time."""
        return Reply(f"<DecisionMaking>{self._model}</DecisionMaking>", model="echo")

    def close(self) -> None:
        """Nothing is held."""


ECHO = ModelClientSpec(
    make=lambda model, settings, ledger, supervisor: Echo(model),
    opens="ACTION",
    help="says one action again and again",
)
HANDS = Observation(
    space=lambda width, height: spaces.Box(0, 1, (1,), np.float32),
    build=lambda situation: np.array([situation.perception.objects.held >= 0], np.float32),
)


def two_tasks() -> Suite:
    """The first two of the bundled mini suite."""
    mini = load_suite("mini")
    return replace(mini, name="two-tasks", tasks=mini.tasks[:2])


def ask(prompt: str) -> str:
    """Reply to a paraphraser's prompt."""
    return f"{len(prompt)} characters."
