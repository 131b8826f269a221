"""Agents without a model: oracle, random, searcher and its kin, and those that cannot think."""
