"""Scripts that make pages of ``docs/``; not in the wheel."""
