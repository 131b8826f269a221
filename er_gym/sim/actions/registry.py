"""The table of actions: their AI2-THOR names, their handlers and their parameters.

A handler is a plain function ``handler(world, *, objectId: str, …)``. Its annotations declare the
action's parameters. It returns the event's ``actionReturn`` or raises
:class:`~er_gym.sim.errors.ActionFailed`. As in AI2-THOR, there are two kinds of actions:

- An action with *named parameters* is strict. A call is invalid, and the official client raises
  ValueError, if an argument is unknown, missing or cannot be converted. The action may have several
  signatures, such as ``objectId`` and ``x, y``. The signature that knows most of the arguments is
  used, and of several such the one with the fewest required parameters.
- An action that takes a *server action* gets a record of the arguments of all actions. It ignores
  keys that it does not read. The case of keys does not matter, and null means that nothing was
  given.

Other packages add actions (``docs/extending.md``): functions under :func:`action`, which are named
in the environment variable ``ER_GYM_PLUGINS`` or by entry points in the group ``er_gym.actions``.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from typing import Any, get_type_hints

from er_gym.plugins import PluginError, added_objects
from er_gym.sim.actions.conversion import Kind, Unconvertible, kind_of
from er_gym.sim.actions.refused import REFUSED
from er_gym.sim.crew import act_as
from er_gym.sim.errors import (
    INVALID_ACTION,
    INVALID_ARGUMENT,
    MISSING_ARGUMENTS,
    ActionFailed,
    WrongCall,
)
from er_gym.sim.world import World

EXEMPT = frozenset(
    {
        *("action", "sequenceId", "agentId", "renderImage", "renderObjectImage"),
        *("renderClassImage", "renderNormalsImage", "renderInstanceSegmentation"),
        # The official client adds these by itself.
        *("renderSemanticSegmentation", "visibilityDistance"),
    }
)
"""Arguments that any action may carry."""
REQUIRED: Any = inspect.Parameter.empty
"""The default of a required parameter."""
_LONGEST_QUOTE = 200
"""Characters of a given value that an error message repeats."""
_MOST_NAMES = 8
"""Argument names that an error message repeats."""

Run = Callable[..., Any]


@dataclass(frozen=True)
class Parameter:
    """A parameter of an action.

    Attributes:
        annotation: the type that the handler declares.
        default: :data:`REQUIRED` if there is none.
    """

    name: str
    annotation: Any
    kind: Kind
    default: Any = REQUIRED

    @property
    def required(self) -> bool:
        return self.default is REQUIRED

    def __str__(self) -> str:
        default = "" if self.required else f" = {self.default}"
        return f"{self.kind.name} {self.name}{default}"


@dataclass(frozen=True)
class Signature:
    """A signature of an action: a handler and its parameters.

    Attributes:
        run: the handler.
        parameters: by name, in the handler's order.
        server_action: whether it takes a server action and not named parameters.
    """

    action: str
    run: Run
    parameters: Mapping[str, Parameter]
    server_action: bool = False

    def __str__(self) -> str:
        return f"{self.action}({', '.join(map(str, self.parameters.values()))})"

    @property
    def cost(self) -> tuple[int, int]:
        """The numbers of its required parameters and of all its parameters."""
        return sum(p.required for p in self.parameters.values()), len(self.parameters)

    def knows(self, request: Mapping[str, Any]) -> int:
        """How many of the request's arguments it has parameters for."""
        return sum(name in self.parameters for name in request)

    def arguments(
        self, request: Mapping[str, Any], signatures: tuple[Signature, ...]
    ) -> dict[str, Any]:
        """The handler's arguments from a request.

        Args:
            signatures: all signatures of this action, for the error message.

        Raises:
            WrongCall, ActionFailed: an argument is missing, unknown or cannot be converted.
        """
        if self.server_action:
            return self._read(request)
        known = self.parameters
        unknown = [name for name in request if name not in known and name not in EXEMPT]
        if unknown:
            raise _unknown_arguments(self, unknown, request, signatures)
        found = {
            name: self._converted(known[name], value)
            for name, value in request.items()
            if name in known
        }
        missing = [name for name in self._required if name not in request]
        if missing:
            raise WrongCall(
                f"action: {self.action} is missing the following arguments: {','.join(missing)}",
                MISSING_ARGUMENTS,
            )
        return found

    def _read(self, request: Mapping[str, Any]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, value in request.items():
            parameter = self._by_lower_case.get(name.lower())
            if parameter is None or value is None:
                continue
            if name == parameter.name or parameter.name not in request:
                found[parameter.name] = self._converted(parameter, value)
        return found

    @cached_property
    def _required(self) -> tuple[str, ...]:
        return tuple(name for name, parameter in self.parameters.items() if parameter.required)

    @cached_property
    def _by_lower_case(self) -> dict[str, Parameter]:
        return {name.lower(): parameter for name, parameter in self.parameters.items()}

    def _converted(self, parameter: Parameter, value: Any) -> Any:
        try:
            return parameter.kind.convert(value)
        except Unconvertible as error:
            why = f" ({error})"[:_LONGEST_QUOTE] if str(error) else ""
            message = (
                f"action: {self.action} has an invalid argument: {parameter.name} "
                f"(=={_shown(value)}). Cannot convert to: {parameter.kind.name}{why}"
            )
            if self.server_action or not parameter.kind.single:
                raise ActionFailed(message) from None
            raise WrongCall(message, INVALID_ARGUMENT) from None


ACTIONS: dict[str, tuple[Signature, ...]] = {}
"""All actions with their signatures; those with fewer required parameters come first."""


def action(*names: str, server_action: bool = False) -> Callable[[Run], Run]:
    """Register a handler under one or several AI2-THOR action names.

    A second handler under the same name adds a signature to the action.

    Args:
        server_action: whether AI2-THOR's method takes a server action.
    """

    def register(run: Run) -> Run:
        for name in names:
            add_signature(Signature(name, run, parameters_of(run), server_action))
        return run

    return register


def parameters_of(run: Run) -> dict[str, Parameter]:
    """The parameters of a handler, which are keyword-only."""
    hints = get_type_hints(run)
    return {
        each.name: Parameter(each.name, hints[each.name], kind_of(hints[each.name]), each.default)
        for each in inspect.signature(run).parameters.values()
        if each.kind is inspect.Parameter.KEYWORD_ONLY
    }


def add_signature(signature: Signature) -> None:
    """Add a signature to the table."""
    signatures = sorted((*ACTIONS.get(signature.action, ()), signature), key=lambda each: each.cost)
    ACTIONS[signature.action] = tuple(signatures)


def load_added() -> None:
    """Import the actions of other packages, which registers them.

    Raises:
        PluginError: an action cannot be loaded, or is not a registered function.
    """
    expected = f"a function under @{__name__}.action"
    for found, origin in added_objects("AI2-THOR action", "actions", expected, registers=True):
        if not any(each.run is found for signatures in ACTIONS.values() for each in signatures):
            raise PluginError(f"{origin} is {found!r}; give {expected}")


def perform(world: World, request: Mapping[str, Any]) -> Any:
    """Let the agent of the request do an action, and return its ``actionReturn``.

    Raises:
        WrongCall: there is no such action or agent, or the call is invalid.
        ActionFailed: the action is not possible in this state of the world.
    """
    agent = request.get("agentId")
    if world.acting if agent is None else (type(agent) is not int or agent != world.acting):
        _take_turn(world, agent)
    name = request.get("action")
    signatures = ACTIONS.get(name) if isinstance(name, str) else None
    if signatures is None:
        raise WrongCall(_unknown(name), INVALID_ACTION)
    signature = (
        signatures[0]
        if len(signatures) == 1
        else max(signatures, key=lambda each: each.knows(request))
    )
    return signature.run(world, **signature.arguments(request, signatures))


_AGENT_ID = kind_of(int)


def _take_turn(world: World, agent: Any) -> None:
    """Let the agent of this id act; None is the first one."""
    try:
        number = 0 if agent is None else _AGENT_ID.convert(agent)
    except Unconvertible:
        number = -1
    if number in world.others:
        act_as(world, number)
    elif number != world.acting:
        last = len(world.others)
        which = f"agents are 0 to {last}" if last else "the only agent is 0"
        raise WrongCall(
            f"agentId is {_shown(agent)}, and {which}; agentCount of Initialize sets how many "
            "there are.",
            INVALID_ARGUMENT,
        )


def quoted(value: object) -> str:
    """A given value for an error message: on one line, and only its beginning."""
    text = repr(value)
    return text if len(text) <= _LONGEST_QUOTE else f"{text[:_LONGEST_QUOTE]}…"


def _shown(value: object) -> str:
    """The same without quotation marks if it is readable so, as in AI2-THOR."""
    plain = isinstance(value, str) and value.isprintable() and len(value) <= _LONGEST_QUOTE
    return str(value) if plain else quoted(value)


def _unknown(name: object) -> str:
    if isinstance(name, str) and name in REFUSED:
        return f"Invalid action: {name}. The embedded engine has no such action: {REFUSED[name]}."
    close = get_close_matches(str(name), ACTIONS, n=3)
    hint = f" Did you mean {' or '.join(close)}?" if close else ""
    return f"Invalid action: {_shown(name)}. The embedded engine has no action of that name.{hint}"


def _unknown_arguments(
    signature: Signature,
    unknown: list[str],
    request: Mapping[str, Any],
    signatures: tuple[Signature, ...],
) -> WrongCall:
    given = [name for name in request if name not in EXEMPT]
    several = "s" if len(unknown) > 1 else ""
    expected = ", ".join(map(str, signature.parameters.values())) or "none"
    return WrongCall(
        f'Action: "{signature.action}" called with invalid argument{several}: {_names(unknown)}. '
        f"Expected arguments: {expected}. Your arguments: {_names(given)}. "
        f'Valid ways to call "{signature.action}" action: {" or ".join(map(str, signatures))}.',
        INVALID_ARGUMENT,
    )


def _names(names: list[str]) -> str:
    shown = [repr(name) if len(name) <= 40 else f"{name[:40]!r}…" for name in names[:_MOST_NAMES]]
    return ", ".join([*shown, "…"] if len(names) > _MOST_NAMES else shown)
