"""Compares the embedded engine with AI2-THOR's recordings: one comparison a file, no verdicts."""
