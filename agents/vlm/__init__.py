"""Agents that look, think and act by way of a language model, with eyes or without."""
