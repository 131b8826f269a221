"""Programs that look for what er-gym does wrong; in the repository only, not in the wheel."""
