"""The table of actions: AI2-THOR's name, the function that does it, its checked parameters.

A handler is a plain function ``handler(world, *, objectId: str, …)`` whose annotations are the
action's parameters; pydantic checks and converts them. It returns the event's ``actionReturn`` or
raises :class:`~er_gym.sim.errors.ActionFailed`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from typing import Any, get_type_hints

from pydantic import BaseModel, ConfigDict, ValidationError, create_model

from er_gym.sim.errors import INVALID_ACTION, INVALID_ARGUMENT, MISSING_ARGUMENTS, ActionFailed
from er_gym.sim.world import World

GLOBAL_PARAMETERS = frozenset(
    {
        "action", "sequenceId", "agentId", "renderImage", "renderDepthImage",
        "renderInstanceSegmentation", "renderSemanticSegmentation", "renderNormalsImage",
        "renderClassImage", "renderObjectImage", "visibilityDistance", "fastActionEmit",
    }
)  # fmt: skip
"""Parameters that any action may carry."""


class Vector(BaseModel):
    """A point or a direction as AI2-THOR writes it; further keys are ignored."""

    model_config = ConfigDict(allow_inf_nan=False)

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True)
class Handler:
    """An action as registered."""

    name: str
    run: Callable[..., Any]
    parameters: type[BaseModel]

    @cached_property
    def fields(self) -> frozenset[str]:
        """The names of its parameters."""
        return frozenset(self.parameters.model_fields)


ACTIONS: dict[str, Handler] = {}
REFUSED = {
    "CreateHouse": "it has the recorded iTHOR rooms and no procedural houses; backend='unity' has"
}
"""Actions of AI2-THOR that are known, not there, and worth a reason."""
_LONGEST_QUOTE = 200
"""Characters of what was given that an error message repeats."""


def action(*names: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a handler under one or several AI2-THOR action names."""

    def register(run: Callable[..., Any]) -> Callable[..., Any]:
        hints = get_type_hints(run)
        fields: dict[str, Any] = {
            parameter.name: (
                hints[parameter.name],
                ... if parameter.default is inspect.Parameter.empty else parameter.default,
            )
            for parameter in inspect.signature(run).parameters.values()
            if parameter.kind is inspect.Parameter.KEYWORD_ONLY
        }
        for name in names:
            model = create_model(
                name, __config__=ConfigDict(extra="forbid", allow_inf_nan=False), **fields
            )
            ACTIONS[name] = Handler(name, run, model)
        return run

    return register


def perform(world: World, request: Mapping[str, Any]) -> Any:
    """Do an action; returns its ``actionReturn``.

    Raises:
        ActionFailed: it is unknown, wrongly called, or cannot be done in this state of the world.
    """
    name = request.get("action")
    handler = ACTIONS.get(name) if isinstance(name, str) else None
    if handler is None:
        raise ActionFailed(_unknown(name), INVALID_ACTION)
    given = {
        key: value
        for key, value in request.items()
        if value is not None and (key in handler.fields or key not in GLOBAL_PARAMETERS)
    }
    try:
        checked = handler.parameters(**given)
    except ValidationError as error:
        raise _wrongly_called(handler, error) from None
    return handler.run(world, **vars(checked))


def quoted(value: object) -> str:
    """What was given, as an error message repeats it: on one line, and only its beginning."""
    text = repr(value)
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}…"


def _unknown(name: object) -> str:
    if isinstance(name, str) and name in REFUSED:
        return f"The embedded engine has no action {name!r}: {REFUSED[name]}."
    close = get_close_matches(str(name), ACTIONS, n=3)
    hint = f" Did you mean {' or '.join(close)}?" if close else ""
    return f"The embedded engine has no action {quoted(name)}.{hint}"


def _wrongly_called(handler: Handler, error: ValidationError) -> ActionFailed:
    problems = error.errors(include_url=False)
    allowed = ", ".join(handler.parameters.model_fields) or "none"
    missing = [str(p["loc"][0]) for p in problems if p["type"] == "missing"]
    if missing:
        return ActionFailed(
            f"{handler.name} needs {', '.join(missing)}; its arguments are: {allowed}.",
            MISSING_ARGUMENTS,
        )
    first = problems[0]
    where = ".".join(str(part) for part in first["loc"])
    if len(where) > _LONGEST_QUOTE or not where.isprintable():
        where = quoted(where)
    said = "is not an argument" if first["type"] == "extra_forbidden" else first["msg"]
    return ActionFailed(
        f"{handler.name} was called with {where}={quoted(first['input'])}: {said}; "
        f"its arguments are: {allowed}.",
        INVALID_ARGUMENT,
    )
