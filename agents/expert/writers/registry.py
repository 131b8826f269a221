"""The writers of thoughts by name."""

from __future__ import annotations

from collections.abc import Callable

from agents.expert.writers.base import ThoughtWriter
from agents.expert.writers.grounded import GroundedWriter
from er_gym.plugins import Registry

WRITERS: Registry[Callable[[], ThoughtWriter]] = Registry(
    kind="writer of thoughts",
    group="er_gym.thought_writers",
    own={"grounded": GroundedWriter},
    expected="a writer's class (agents.expert.writers.base.ThoughtWriter), or a function that "
    "makes a writer",
    fits=callable,
)
"""The factories of writers by name. A factory is called without arguments."""
