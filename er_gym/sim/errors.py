"""How an action says that it could not be done."""

from __future__ import annotations


class ActionFailed(Exception):
    """An action was refused; it becomes an event with ``lastActionSuccess`` False.

    Attributes:
        code: AI2-THOR's ``errorCode``. The codes in :data:`CLIENT_ERRORS` make the official client
            raise ValueError, since they mean that the call itself was wrong.
    """

    def __init__(self, message: str, code: str = "") -> None:
        super().__init__(message)
        self.code = code


INVALID_ACTION = "InvalidAction"
MISSING_ARGUMENTS = "MissingArguments"
INVALID_ARGUMENT = "InvalidArgument"
CLIENT_ERRORS = frozenset({INVALID_ACTION, MISSING_ARGUMENTS, INVALID_ARGUMENT, "AmbiguousAction"})
