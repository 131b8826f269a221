"""The writers of thoughts by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from agents.expert.writers.base import ThoughtWriter
from agents.expert.writers.checked import CheckedWriter
from agents.expert.writers.grounded import GroundedWriter
from er_gym.plugins import PluginError, Registry, error_line


def checked_grounded() -> ThoughtWriter:
    """The grounded writer, with the critic's check of its thoughts."""
    return CheckedWriter(GroundedWriter())


WRITERS: Registry[Callable[[], ThoughtWriter]] = Registry(
    kind="writer of thoughts",
    group="er_gym.thought_writers",
    own={"grounded": checked_grounded},
    expected="a writer's class (agents.expert.writers.base.ThoughtWriter), or a function that "
    "makes a writer",
    fits=callable,
)
"""The factories of writers by name. A factory is called without arguments."""


@dataclass(frozen=True)
class NamedWriter:
    """Makes a writer by name, in any process; each process has one of each name."""

    name: str

    def __call__(self) -> ThoughtWriter:
        """The writer.

        Raises:
            ValueError: there is no such writer, and the message lists those there are; or what the
                name stands for makes none.
        """
        return _writer(self.name)


@lru_cache(maxsize=8)
def _writer(name: str) -> ThoughtWriter:
    make = WRITERS.get(name)
    try:
        writer = make()
    except Exception as error:  # another package's code can raise anything
        raise PluginError(
            f"writer of thoughts {name!r} cannot be made ({error_line(error)}); it is called "
            "without arguments"
        ) from error
    if not (isinstance(getattr(writer, "name", None), str) and hasattr(writer, "write")):
        raise PluginError(
            f"writer of thoughts {name!r} is {writer!r:.200}, which lacks a name or write; give "
            f"{WRITERS.expected}"
        )
    return writer
