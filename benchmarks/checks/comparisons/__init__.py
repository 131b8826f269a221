"""Compares the embedded engine with AI2-THOR's recordings, without verdicts: a source a file."""
