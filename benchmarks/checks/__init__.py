"""Checks of er-gym's guarantees. They are run by hand and are not in the wheel."""
