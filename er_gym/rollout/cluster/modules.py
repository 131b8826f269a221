"""The Python modules that workers on other machines need beside er-gym."""

from __future__ import annotations

import sys
import sysconfig
from collections.abc import Iterable
from importlib.machinery import PathFinder
from pathlib import Path

_INSTALLED = tuple(
    Path(sysconfig.get_path(name)).resolve() for name in ("stdlib", "purelib", "platlib")
)
_OWN = frozenset({"er_gym", "agents", "benchmarks"})


def modules_of(names: Iterable[str]) -> list[Path]:
    """The files and folders of the modules in dotted names, ``package.module:Class``.

    Other names have none, and so have installed packages: nodes are to have them installed.
    """
    found: dict[str, Path] = {}
    for name in names:
        module, colon, _ = name.partition(":")
        top = module.partition(".")[0]
        if not colon or not top.isidentifier() or top in _OWN:
            continue
        place = _place_of(top)
        if place is not None and not any(place.is_relative_to(each) for each in _INSTALLED):
            found[top] = place
    return list(found.values())


def _place_of(top: str) -> Path | None:
    """The folder of a package, or the file of a module; None if there is none. Nothing is run."""
    spec = PathFinder.find_spec(top, ["", *sys.path])
    if spec is None or spec.origin is None:
        return None
    origin = Path(spec.origin).resolve()
    return origin.parent if spec.submodule_search_locations else origin
