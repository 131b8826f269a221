"""The table of what is generated: the rows of every family."""

from __future__ import annotations

from er_gym.tasks.generate import composite, manipulate, search, transport
from er_gym.tasks.generate.recipes import bundled_recipes, rows
from er_gym.tasks.types import BY_NAME

ROWS = (
    *search.ROWS,
    *manipulate.ROWS,
    *transport.ROWS,
    *composite.ROWS,
    *rows(bundled_recipes()),
)

GENERATED_TYPES = tuple(BY_NAME[name] for name in dict.fromkeys(row.type for row in ROWS))
"""The task types that :func:`~er_gym.tasks.generate.generate_tasks` makes."""
