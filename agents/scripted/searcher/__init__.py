"""The strongest agent without a model and without privileged knowledge."""

from agents.scripted.searcher.agent import SearcherAgent

__all__ = ["SearcherAgent"]
