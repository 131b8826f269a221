"""The strongest agent without a model and without privileged knowledge."""

from agents.scripted.searcher.agent import SearcherAgent
from agents.scripted.searcher.spotter import SpotterAgent

__all__ = ["SearcherAgent", "SpotterAgent"]
