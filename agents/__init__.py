"""Agents, which act on observations; :func:`make_agent` makes one by name.

::

    import er_gym
    from agents import make_agent

    agent = make_agent("searcher", seed=0)
    env = er_gym.EmbodiedEnv(obs_mode=agent.obs_mode)
    task = er_gym.load_suite("mini").tasks[0]
    record = er_gym.play_episode(env, agent, task, seed=0)

A name is that of one of :data:`AGENTS` (``oracle``, ``random``, ``searcher``, ``spotter``,
``mask-reader`` and those that cannot think: ``instruction-blind``, ``do-nothing`` and others), a
class of your own (``package.module:Class``), a trained policy (``rl:RUN``), a model of the zoo
(``zoo:NAME``), or a model agent (``openai:MODEL``, ``hf:PATH``). ``examples/own_agent.py`` writes
one; ``docs/agents.md`` explains those that ask models.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from inspect import signature
from pathlib import Path
from typing import Any

from agents.factory import (
    AgentFactory,
    agent_name_forms,
    is_model_agent,
    load_settings,
    settings_file,
)
from agents.scripted.oracle import OracleAgent
from agents.scripted.random import RandomAgent
from agents.scripted.searcher import SearcherAgent, SpotterAgent
from agents.scripted.searcher.blind import InstructionBlindAgent
from agents.scripted.searcher.mask_reader import MaskReaderAgent
from agents.scripted.thoughtless import (
    AlwaysEndAgent,
    DoNothingAgent,
    RepeatLastAgent,
    TakesAllAgent,
)
from agents.zoo.index import PREFIX as ZOO_PREFIX
from agents.zoo.index import resolved
from er_gym.activity import begin_import
from er_gym.extras import MissingPackage, is_own
from er_gym.plugins import PluginError, Registry, error_line
from er_gym.rollout.agent import Agent, Decision, MakeAgent
from er_gym.tasks.task import Task

__all__ = [
    "AGENTS",
    "Agent",
    "Decision",
    "NamedAgent",
    "OracleAgent",
    "RandomAgent",
    "SearcherAgent",
    "make_agent",
]

RL_PREFIX = "rl:"
"""The prefix of a trained policy's name; its run directory follows."""
AGENTS: Registry[Callable[..., Agent]] = Registry(
    kind="agent",
    group="er_gym.agents",
    own={
        "oracle": OracleAgent,
        "random": RandomAgent,
        "searcher": SearcherAgent,
        "spotter": SpotterAgent,
        "mask-reader": MaskReaderAgent,
        "instruction-blind": InstructionBlindAgent,
        "do-nothing": DoNothingAgent,
        "always-end": AlwaysEndAgent,
        "repeat-last": RepeatLastAgent,
        "takes-all": TakesAllAgent,
    },
    expected="an agent's class (er_gym.rollout.agent.Agent), or a function that makes an agent",
    fits=callable,
    others=f"{RL_PREFIX}RUN with a run directory of er-gym train-rl; {ZOO_PREFIX}NAME with a model "
    f"that er-gym zoo lists; {agent_name_forms()}",
)
"""The factories of agents by name. A factory is called with ``seed=`` if it takes a seed, else
without arguments."""


def make_agent(name: str, seed: int = 0) -> Agent:
    """Make an agent by name: one of :data:`AGENTS`, ``package.module:Class``, ``rl:RUN`` for a
    trained policy, ``zoo:NAME`` for a model of the zoo, or a model agent with default settings
    (:mod:`agents.factory`).

    Args:
        name: the agent's name.
        seed: of the agent's random choices.

    Raises:
        ValueError: no agent has this name, or it cannot be made; the message lists the agents.
    """
    behind = resolved(name)
    if behind.startswith(RL_PREFIX):
        return _rl_agent(name, behind.removeprefix(RL_PREFIX))
    if is_model_agent(name):
        return _model_agents(name).agent(seed)
    make = AGENTS.get(name)
    if name in AGENTS.own:
        return _construct(make, seed)
    try:
        agent = _construct(make, seed)
    except (Exception, SystemExit) as error:  # another package's code can raise anything
        raise PluginError(
            f"agent {name!r} cannot be made ({error_line(error)}); it is called with seed= if it "
            "takes that, else without arguments"
        ) from error
    parts: dict[str, Any] = {"obs_mode": str, "reset": Callable, "act": Callable}
    lacking = [
        part for part, kind in parts.items() if not isinstance(getattr(agent, part, None), kind)
    ]
    if lacking:
        raise PluginError(
            f"agent {name!r} makes {type(agent).__name__}, which has no {lacking[0]!r}; an agent "
            "needs obs_mode (a text), reset and act (er_gym.rollout.agent.Agent)"
        )
    return agent


def _construct(make: Callable[..., Agent], seed: int) -> Agent:
    try:
        takes_seed = "seed" in signature(make).parameters
    except (TypeError, ValueError):  # a builtin without a signature
        takes_seed = False
    return make(seed=seed) if takes_seed else make()


@dataclass(frozen=True)
class NamedAgent:
    """Makes the agents of a run by name, in any process: a :class:`.rollout.agent.MakeAgent`."""

    name: str

    def __call__(self, task: Task, seed: int) -> Agent:
        """Make the agent of an episode."""
        return make_agent(self.name, seed)

    def carried(self) -> MakeAgent:
        """The same for workers that do not see this machine's files."""
        if not self.name.startswith(RL_PREFIX):
            return self
        from agents.carried_policy import CarriedPolicy

        return CarriedPolicy.of(Path(self.name.removeprefix(RL_PREFIX)))


@lru_cache(maxsize=4)
def _model_agents(name: str) -> AgentFactory:
    return AgentFactory(name, load_settings(None, (), settings_file(name)))


def _rl_agent(name: str, path: str) -> Agent:
    begin_import("PyTorch", "torch")
    try:
        from agents.rl.agent import RLAgent  # late: torch
    except ImportError as error:
        if is_own(error):
            raise
        raise MissingPackage(f"agent {name}", str(error.name), "er-gym[rl]") from error
    return RLAgent(path)


def __dir__() -> list[str]:
    return [*__all__]
