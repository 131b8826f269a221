"""Agents that a vision-language model or a text-only language model drives."""
