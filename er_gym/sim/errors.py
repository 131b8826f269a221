"""How an action says that it was not done, and how a call says that it was wrong."""

from __future__ import annotations

INVALID_ACTION = "InvalidAction"
MISSING_ARGUMENTS = "MissingArguments"
INVALID_ARGUMENT = "InvalidArgument"
CLIENT_ERRORS = frozenset({INVALID_ACTION, MISSING_ARGUMENTS, INVALID_ARGUMENT, "AmbiguousAction"})
"""AI2-THOR's ``errorCode`` at which the official client raises ValueError: the call was wrong."""


class ActionFailed(Exception):
    """An action was refused; it becomes an event with ``lastActionSuccess`` False.

    Handlers raise this and nothing else. It cannot carry one of :data:`CLIENT_ERRORS`, so that no
    handler makes a client raise.

    Attributes:
        code: AI2-THOR's ``errorCode``, which is None for all refusals but a few.
        reply: the event's ``actionReturn``.
    """

    def __init__(self, message: str, code: str | None = None, reply: str | None = None) -> None:
        if code in CLIENT_ERRORS:
            raise TypeError(f"{code} is for calls that dispatch refuses, not for actions")
        super().__init__(message)
        self.code = code
        self.reply = reply


class WrongCall(Exception):
    """A call that no action answers to, at which the official client raises ValueError.

    Dispatch raises this, before any handler runs.

    Attributes:
        code: one of :data:`CLIENT_ERRORS`.
    """

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.code = code
