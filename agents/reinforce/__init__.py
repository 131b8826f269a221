"""Reinforcement of language models: a model plays, and learns from the rewards of its episodes.

Read :mod:`agents.reinforce.train` from top to bottom; it is the whole run. Beside it are pure
functions: rewards, advantages, the objective, the choice of tasks.
"""
