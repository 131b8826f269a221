"""Policies that act through ``reset`` and ``step``; :func:`make_agent` makes one by name."""

from __future__ import annotations

from collections.abc import Callable

from agents.base import Agent, Decision
from agents.scripted.oracle import OracleAgent
from agents.scripted.random import RandomAgent
from agents.scripted.searcher import SearcherAgent

__all__ = [
    "AGENTS",
    "Agent",
    "Decision",
    "OracleAgent",
    "RandomAgent",
    "SearcherAgent",
    "make_agent",
]

AGENTS: dict[str, Callable[[int], Agent]] = {
    "oracle": lambda seed: OracleAgent(),
    "random": RandomAgent,
    "searcher": lambda seed: SearcherAgent(),
}
"""By name: how to make the agent, given a seed."""


def make_agent(name: str, seed: int = 0) -> Agent:
    """An agent by name.

    Raises:
        ValueError: there is none of that name; the message lists those there are.
    """
    make = AGENTS.get(name)
    if make is None:
        raise ValueError(f"unknown agent {name!r}; choose one of: {', '.join(AGENTS)}")
    return make(seed)
