"""Where er-gym's configurations are."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def config_directory(kind: str) -> Path:
    """The folder of the configurations of a kind, such as ``suites``.

    A wheel has configs/ inside the package, a checkout has it beside the package.
    """
    inside = _PACKAGE / "configs" / kind
    return inside if inside.is_dir() else _PACKAGE.parent / "configs" / kind
