"""Reinforcement learning agents; they need the extra ``rl`` (torch, Stable-Baselines3).

This file imports nothing, since worker processes must not import torch.
"""
