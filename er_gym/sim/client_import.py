"""Imports AI2-THOR's client without botocore and Flask, a third of what it takes to start.

``ai2thor.build`` uses botocore to download private builds of Unity, and ``ai2thor.wsgi_server``
uses Flask to talk to Unity over HTTP. The embedded engine does neither. Whatever in this process
does either imports them then.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

_AMAZON = "aws_requests_auth.boto_utils"
_WSGI = "ai2thor.wsgi_server"


class _Later(ModuleType):
    """Stands where a package has a module, and imports it when something of it is read."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # what imports and pickle look for
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return getattr(importlib.import_module(self.__name__), name)


def _amazon_login(*args: Any, **kwargs: Any) -> Any:
    """As ``BotoAWSRequestsAuth``, of which ``ai2thor.build`` reads no more than the name."""
    return importlib.import_module(_AMAZON).BotoAWSRequestsAuth(*args, **kwargs)


def import_client() -> None:
    """Import ``ai2thor.controller``; afterwards ``import ai2thor.controller`` finds it."""
    import ai2thor

    amazon, wsgi = ModuleType(_AMAZON), _Later(_WSGI)
    amazon.BotoAWSRequestsAuth = _amazon_login  # type: ignore[attr-defined]
    stand_ins = {
        name: module
        for name, module in ((_AMAZON, amazon), (_WSGI, wsgi))
        if name not in sys.modules
    }
    if _WSGI in stand_ins:
        ai2thor.wsgi_server = wsgi  # a later import of the module replaces it
    sys.modules.update(stand_ins)
    try:
        importlib.import_module("ai2thor.controller")
    finally:
        for name in stand_ins:
            sys.modules.pop(name, None)
