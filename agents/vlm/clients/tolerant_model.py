"""The base of pydantic models of server answers: one invalid field does not reject the others."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, WrapValidator


class TolerantModel(BaseModel):
    """Accepts that servers omit fields, send null for them, and add their own."""

    model_config = ConfigDict(frozen=True, extra="ignore")


def _or_none(value: object, check: Any) -> Any:
    try:
        return check(value)
    except ValueError:
        return None


T = TypeVar("T")
OrNone = Annotated[T | None, WrapValidator(_or_none)]
"""A field that becomes None if the value sent is invalid."""
