"""The table of all rules: those of every family."""

from __future__ import annotations

from er_gym.tasks.generate import composite, manipulate, search, transport
from er_gym.tasks.generate.recipes import bundled_recipes, recipe_rules
from er_gym.tasks.types import BY_NAME

RULES = (
    *search.RULES,
    *manipulate.RULES,
    *transport.RULES,
    *composite.RULES,
    *recipe_rules(bundled_recipes()),
)

GENERATED_TYPES = tuple(BY_NAME[name] for name in dict.fromkeys(rule.type for rule in RULES))
"""The task types that :func:`~er_gym.tasks.generate.generate_tasks` makes."""
