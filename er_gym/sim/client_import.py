"""Imports AI2-THOR's client without botocore, requests and Flask: half of what it takes to import.

``ai2thor.build`` downloads Unity with requests, private builds of it with botocore, and
``ai2thor.wsgi_server`` talks to Unity with Flask. The embedded engine does none of that. Whatever
in this process does it imports them then.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

_AMAZON = "aws_requests_auth.boto_utils"
_WSGI = "ai2thor.wsgi_server"
_HTTP = "requests"


class _Later(ModuleType):
    """Stands where a package has a module, and imports it when something of it is read."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # what imports and pickle look for
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        return getattr(importlib.import_module(self.__name__), name)


def _amazon_login(*args: Any, **kwargs: Any) -> Any:
    """As ``BotoAWSRequestsAuth``, of which ``ai2thor.build`` reads no more than the name."""
    return importlib.import_module(_AMAZON).BotoAWSRequestsAuth(*args, **kwargs)


def import_client() -> None:
    """Import ``ai2thor.controller``; afterwards ``import ai2thor.controller`` finds it."""
    import ai2thor

    amazon = ModuleType(_AMAZON)
    amazon.BotoAWSRequestsAuth = _amazon_login  # type: ignore[attr-defined]
    all_of_them = {_AMAZON: amazon, _WSGI: _Later(_WSGI), _HTTP: _Later(_HTTP)}
    stand_ins = {name: each for name, each in all_of_them.items() if name not in sys.modules}
    if _WSGI in stand_ins:
        ai2thor.wsgi_server = stand_ins[_WSGI]  # a later import of the module replaces it
    sys.modules.update(stand_ins)
    try:
        importlib.import_module("ai2thor.controller")
    finally:
        for name, stand_in in stand_ins.items():
            if sys.modules.get(name) is stand_in:
                del sys.modules[name]
