"""Policies that act through ``reset`` and ``step``; :func:`make_agent` makes one by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from agents.base import Agent, Decision
from agents.scripted.oracle import OracleAgent
from agents.scripted.random import RandomAgent
from agents.scripted.searcher import SearcherAgent
from agents.vlm.settings import AgentSettings
from agents.vlm.speaker import Speaker, speaks, ways_to_name

__all__ = [
    "AGENTS",
    "Agent",
    "Decision",
    "OracleAgent",
    "RandomAgent",
    "SearcherAgent",
    "make_agent",
]

RL = "rl:"
"""What the name of a trained policy begins with; its run directory follows."""
AGENTS: dict[str, Callable[[int], Agent]] = {
    "oracle": lambda seed: OracleAgent(),
    "random": RandomAgent,
    "searcher": lambda seed: SearcherAgent(),
}
"""By name: how to make the agent, given a seed."""


def make_agent(name: str, seed: int = 0, *, trust: bool = False) -> Agent:
    """An agent by name: one of :data:`AGENTS`, ``rl:RUN`` for a trained policy, or, with the
    settings that are the default, one that speaks (:mod:`agents.vlm.speaker`).

    ``trust``: whether a policy may be read from a file that can run code (:mod:`agents.rl.saved`).

    Raises:
        ValueError: there is none of that name; the message lists those there are.
    """
    if name.startswith(RL):
        return _trained(name.removeprefix(RL), trust)
    if speaks(name):
        return _speaker(name).agent(seed)
    make = AGENTS.get(name)
    if make is None:
        raise ValueError(
            f"unknown agent {name!r}; choose one of: {', '.join(AGENTS)}; "
            f"{RL}RUN with a run directory of er-gym train-rl; {ways_to_name()}"
        )
    return make(seed)


@lru_cache(maxsize=4)
def _speaker(name: str) -> Speaker:
    return Speaker(name, AgentSettings())


def _trained(path: str, trust: bool) -> Agent:
    try:
        from agents.rl.agent import RLAgent  # late: torch
    except ImportError as error:
        raise ValueError(
            f"agent {RL}{path} needs {error.name}, which is not installed: pip install 'er-gym[rl]'"
        ) from error
    return RLAgent(path, trust)
