"""Runs of vision-language agents: what a user says of the model, and how they are played."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agents.factory import AgentFactory, comparable_settings, load_settings, settings_file
from agents.vlm.clients.budget import Budget
from agents.vlm.clients.session import ModelSession
from agents.vlm.prompts import prompts_for
from agents.vlm.settings import AgentSettings
from er_gym.rollout import runner
from er_gym.rollout.events import EventListener
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.run_directory import RunDirectory
from er_gym.rollout.runner import RunSummary
from er_gym.tasks.task import Task

_CONCURRENCY = 8


@dataclass(frozen=True)
class VLMRun:
    """A run with a vision-language agent.

    Attributes:
        name: such as ``openai:MODEL``.
        settings: of the agent.
        budget: what may be spent.
        concurrency: how many conversations at once.
        tuned_for: the file with the settings that the model was tuned for, which hold beneath those
            of the command line; None if there is none.
    """

    name: str
    settings: AgentSettings
    budget: Budget
    concurrency: int
    tuned_for: Path | None = None

    @staticmethod
    def of(
        name: str,
        *,
        agent_config: str | None = None,
        overrides: Sequence[str] = (),
        base_url: Sequence[str] = (),
        prompts_from: Path | None = None,
        concurrency: int | None = None,
        max_usd: float | None = None,
        max_tokens: int | None = None,
        max_minutes: float | None = None,
    ) -> VLMRun:
        """From the options of a command, by their names.

        Raises:
            ValueError: a setting does not fit.
        """
        given = {
            "server.base_url": base_url[0] if len(base_url) == 1 else list(base_url),
            "prompts.dataset": str(prompts_from or ""),
        }
        more = [f"{name}={json.dumps(value)}" for name, value in given.items() if value]
        tuned_for = settings_file(name)
        if tuned_for is not None and prompts_from is not None:
            more.append('prompts.dialect=""')  # instead of the model's own
        settings = load_settings(agent_config, (*overrides, *more), tuned_for)
        budget = Budget(max_usd=max_usd, max_tokens=max_tokens, max_minutes=max_minutes)
        return VLMRun(name, settings, budget, concurrency or _CONCURRENCY, tuned_for)

    @property
    def comparable_settings(self) -> dict[str, Any]:
        """The settings that decide its replies."""
        return comparable_settings(self.settings, prompts_for(self.settings).digest)

    @property
    def env(self) -> dict[str, Any]:
        """The environment's arguments that it asks for."""
        return self.settings.env

    def factory(self, run: Path) -> AgentFactory:
        """What makes the agents of a run; it keeps replies and bills in the run directory."""
        return AgentFactory(self.name, self.settings, run, self.budget)

    def session(self, run: Path) -> ModelSession:
        """The model alone, for callers with prompts of their own."""
        return ModelSession(self.name, self.settings, run, self.budget)

    def play(
        self,
        factory: AgentFactory,
        directory: RunDirectory,
        tasks: Sequence[Task],
        parallelism: Parallelism,
        listeners: Iterable[EventListener] = (),
        say: Callable[[object], None] | None = None,
        samples: int = 1,
    ) -> RunSummary:
        """Play the tasks that the run directory has no finished episode of, each ``samples`` times.

        ``parallelism`` states the workers and where they run; the conversations are as many as this
        run has. ``say`` is called, from any thread, with messages about the server for the user;
        without it, a logger warns.
        """
        if say is not None:
            factory.supervisor.show = say
        return runner.run(
            directory,
            tasks,
            lambda task, seed: factory.agent(seed),
            executor="threads",
            parallelism=replace(parallelism, concurrency=self.concurrency),
            listeners=listeners,
            cost=lambda: factory.cost,
            samples=samples,
        )
