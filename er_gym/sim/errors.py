"""The exceptions of refused actions and of invalid calls."""

from __future__ import annotations

INVALID_ACTION = "InvalidAction"
MISSING_ARGUMENTS = "MissingArguments"
INVALID_ARGUMENT = "InvalidArgument"
CLIENT_ERRORS = frozenset({INVALID_ACTION, MISSING_ARGUMENTS, INVALID_ARGUMENT, "AmbiguousAction"})
"""AI2-THOR's ``errorCode`` values for invalid calls. The official client raises ValueError for
them."""


class ActionFailed(Exception):
    """An action was refused. It becomes an event with ``lastActionSuccess`` False.

    Handlers raise no other exception. ``code`` cannot be one of :data:`CLIENT_ERRORS`, so no
    handler makes a client raise.

    Attributes:
        code: AI2-THOR's ``errorCode``, None for nearly all refusals.
        reply: the event's ``actionReturn``.
    """

    def __init__(self, message: str, code: str | None = None, reply: str | None = None) -> None:
        if code in CLIENT_ERRORS:
            raise TypeError(f"{code} is for calls that dispatch refuses, not for actions")
        super().__init__(message)
        self.code = code
        self.reply = reply


class WrongCall(Exception):
    """A call is invalid, and the official client raises ValueError for it.

    Dispatch raises this before any handler runs.

    Attributes:
        code: one of :data:`CLIENT_ERRORS`.
    """

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code
