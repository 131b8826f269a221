"""Renders the embedded engine's world on the CPU."""
