"""The conversion of request values to arguments, by AI2-THOR's rules.

These are the rules of its JSON library (Newtonsoft's ``JToken.ToObject``). Numbers are read from
text and bools, bools from numbers, and text from numbers. Null is accepted for optional parameters
and for text. A value that cannot be converted makes the call invalid if it is a single value. If it
is a point, a list or a record, the action merely fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import NoneType
from typing import Any, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

_INT_MAX = 2**31 - 1
"""AI2-THOR's integers have 32 bits."""


class Unconvertible(ValueError):
    """A value cannot be converted. The message gives the reason unless it is obvious."""


@dataclass(frozen=True)
class Kind:
    """The type of a parameter.

    Attributes:
        name: the type's name in AI2-THOR's errors.
        convert: turns a value into the argument; raises :class:`Unconvertible`.
        single: whether it is a number, a bool or a text, and not a point, a list or a record.
    """

    name: str
    convert: Callable[[Any], Any]
    single: bool = True


def kind_of(annotation: Any) -> Kind:
    """The kind of a parameter with a type annotation such as ``float | None``."""
    inner = [part for part in get_args(annotation) if part is not NoneType]
    nullable = NoneType in get_args(annotation)
    kind = _SINGLE.get(inner[0] if nullable and len(inner) == 1 else annotation)
    if kind is None:
        return _structure(annotation, inner[0] if nullable else annotation)
    return Kind(kind.name, _or_null(kind.convert)) if nullable else kind


def _number(value: Any) -> float:
    if not isinstance(value, (float, int, str)):
        return _number(_plain(value))
    try:
        number = float(value)
    except (ValueError, OverflowError):
        raise Unconvertible from None
    if not math.isfinite(number):
        raise Unconvertible("it is not a finite number")
    return number


def _whole(value: Any) -> int:
    if not isinstance(value, (float, int, str)):
        return _whole(_plain(value))
    try:
        number = int(value) if isinstance(value, str) else round(value)  # half to even
    except (ValueError, OverflowError):
        raise Unconvertible from None
    if abs(number) > _INT_MAX:
        raise Unconvertible("it needs more than 32 bits")
    return number


def _truth(value: Any) -> bool:
    if isinstance(value, (bool, int, float)):
        return bool(value)
    if isinstance(value, str):
        found = {"true": True, "false": False}.get(value.strip().lower())
        if found is None:
            raise Unconvertible
        return found
    return _truth(_plain(value))


def _text(value: Any) -> str | None:
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, (bool, int, float)):
        return str(value)
    return _text(_plain(value))


def _plain(value: Any) -> Any:
    """A NumPy value as a Python value, which is how it arrives over the wire."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise Unconvertible


def _or_null(convert: Callable[[Any], Any]) -> Callable[[Any], Any]:
    return lambda value: None if value is None else convert(value)


_SINGLE = {
    float: Kind("float", _number),
    int: Kind("int", _whole),
    bool: Kind("Boolean", _truth),
    str: Kind("String", _text),
}


def _structure(annotation: Any, shown: Any) -> Kind:
    a_record = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    config = None if a_record else ConfigDict(allow_inf_nan=False)  # records have their own
    adapter: TypeAdapter[Any] = TypeAdapter(annotation, config=config)

    def convert(value: Any) -> Any:
        try:
            return adapter.validate_python(
                value.tolist() if isinstance(value, np.ndarray) else value
            )
        except ValidationError as error:
            first = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(map(str, first["loc"]))
            raise Unconvertible(f"{where}: {first['msg']}" if where else first["msg"]) from None

    name = getattr(shown, "__name__", str(shown))
    if get_args(shown):
        name = f"{get_args(shown)[0].__name__}[]"
    return Kind(name, convert, single=False)
