"""Agents without a model: the oracle, and the random one."""
