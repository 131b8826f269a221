"""Agents without a model: the oracle, the random one, the searcher, and the mask reader."""
