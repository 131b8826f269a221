"""The embedded engine beside what AI2-THOR recorded: one comparison a file, no verdicts."""
