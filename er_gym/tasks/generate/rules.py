"""The table of all rules: those of every family."""

from __future__ import annotations

from typing import cast

from er_gym.tasks.generate import composite, manipulate, search, transport
from er_gym.tasks.generate.recipes import bundled_recipes, recipe_rules
from er_gym.tasks.generate.task_plan import TaskRule
from er_gym.tasks.types import BY_NAME, TaskType

RULES = (
    *search.RULES,
    *manipulate.RULES,
    *transport.RULES,
    *composite.RULES,
    *recipe_rules(bundled_recipes()),
)

GENERATED_TYPES = tuple(BY_NAME[name] for name in dict.fromkeys(rule.type for rule in RULES))
"""The task types that come with er-gym and are generated."""


def all_rules() -> tuple[TaskRule, ...]:
    """The rules of every type, those of other packages too."""
    others = (rule for kind in BY_NAME.values() for rule in kind.rules)
    return (*RULES, *(cast(TaskRule, rule) for rule in others))


def generated_types() -> tuple[TaskType, ...]:
    """The task types that :func:`~er_gym.tasks.generate.generate_tasks` makes."""
    return tuple(BY_NAME[name] for name in dict.fromkeys(rule.type for rule in all_rules()))
