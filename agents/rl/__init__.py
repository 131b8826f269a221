"""Agents that learn by reinforcement; needs the extra ``rl`` (torch, Stable-Baselines3).

Nothing here is imported before it is used: worker processes do without torch.
"""
