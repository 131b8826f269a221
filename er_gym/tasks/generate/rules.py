"""The table of what is generated: the rows of every family."""

from __future__ import annotations

from er_gym.tasks.generate import composite, manipulate, search, transport
from er_gym.tasks.generate.recipes import bundled_recipes, rows
from er_gym.tasks.generate.task_plan import Row
from er_gym.tasks.types import BY_NAME, TaskType

ROWS = (
    *search.ROWS,
    *manipulate.ROWS,
    *transport.ROWS,
    *composite.ROWS,
    *rows(bundled_recipes()),
)

GENERATED_TYPES = tuple(BY_NAME[name] for name in dict.fromkeys(row.type for row in ROWS))
"""The task types that come with er-gym and are generated."""


def all_rows() -> tuple[Row, ...]:
    """The rows of every type, those of other packages too."""
    return (*ROWS, *(row for kind in BY_NAME.values() for row in kind.rows))


def generated_types() -> tuple[TaskType, ...]:
    """The task types that :func:`~er_gym.tasks.generate.generate_tasks` makes."""
    return tuple(BY_NAME[name] for name in dict.fromkeys(row.type for row in all_rows()))
