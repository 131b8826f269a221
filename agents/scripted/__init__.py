"""Agents without a model: the oracle, the random one, and the searcher."""
