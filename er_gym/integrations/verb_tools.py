"""The verbs as tools: one function for each, for models that act by calling functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.reading import read_yaml

OBJECT = "object"
"""The name of the one argument, a type of object."""


@dataclass(frozen=True)
class VerbTool:
    """A verb as a function.

    Attributes:
        name: a Python name, ``navigate_to``.
        verb: ``navigate to``.
        about: what the verb does, a sentence or two in English.
    """

    name: str
    verb: str
    about: str

    @property
    def takes_object(self) -> bool:
        """Whether the function has the argument :data:`OBJECT`."""
        return self.verb in verbs.OBJECT_VERBS

    def action(self, of: object = "") -> str:
        """The text of the action, for an object type as a model wrote it."""
        return f"{self.verb} {of}".rstrip() if self.takes_object else self.verb


@lru_cache(maxsize=1)
def verb_tools() -> tuple[VerbTool, ...]:
    """All verbs, with the words in which er-gym's default prompt explains them."""
    told = read_yaml(config_directory("prompts") / "default" / "en" / "actions.yaml")
    return tuple(
        VerbTool(verb.name.replace(" ", "_"), verb.name, _sentence(told, verb))
        for verb in verbs.table()
    )


def _sentence(told: dict[str, str], verb: verbs.Verb) -> str:
    own = verb.words["en"].meaning if "en" in verb.words else ""
    about = told.get(verb.name) or own or f"{verb.name}."
    return about[0].upper() + about[1:]


def as_methods(do: Callable[[Any, str], Any], answers: Any = str) -> Iterator[tuple[str, Any]]:
    """Methods for a class whose instances are rooms: the name and the function of each verb.

    What a library tells a model of a function comes from its type hints and its docstring, in
    Google's style.

    Args:
        do: does the text of an action in a room, and returns what the method returns.
        answers: the type that ``do`` returns.
    """
    for tool in verb_tools():
        yield (
            tool.name,
            _with_object(tool, do, answers) if tool.takes_object else _alone(tool, do, answers),
        )


_RETURNS = "\n\nReturns:\n    What came of it, and what you see, hold and can reach now.\n"


def _with_object(tool: VerbTool, do: Callable[[Any, str], Any], answers: Any) -> Any:
    def method(self: Any, object: str) -> Any:
        return do(self, tool.action(object))

    told = f"{tool.about}\n\nArgs:\n    {OBJECT}: the type of the object, such as Fridge.{_RETURNS}"
    return _dressed(method, tool, told, {OBJECT: str, "return": answers})


def _alone(tool: VerbTool, do: Callable[[Any, str], Any], answers: Any) -> Any:
    def method(self: Any) -> Any:
        return do(self, tool.action())

    return _dressed(method, tool, tool.about + _RETURNS, {"return": answers})


def _dressed(method: Any, tool: VerbTool, told: str, hints: dict[str, Any]) -> Any:
    method.__name__ = method.__qualname__ = tool.name
    method.__doc__, method.__annotations__ = told, hints
    return method
