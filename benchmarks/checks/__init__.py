"""Checks of what er-gym promises, run by hand; not in the wheel."""
