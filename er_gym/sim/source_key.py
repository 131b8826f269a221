"""Names what the engine computes by the source that computes it, for files that keep it."""

from __future__ import annotations

import platform
from functools import cache
from hashlib import blake2b
from pathlib import Path

import numpy as np

from er_gym.version import __version__

_HERE = Path(__file__).parent


@cache
def source_key() -> str:
    """A name of the engine's whole source and of what it computes with: 16 hexadecimal digits.

    Whatever depends on nothing but the packaged data stays as it is while this does.
    """
    found = blake2b(digest_size=8)
    for path in sorted([*_HERE.rglob("*.py"), *_HERE.glob("data/*.json")]):
        found.update(path.relative_to(_HERE).as_posix().encode())
        found.update(path.read_bytes())
    # Another machine or another NumPy may round the last bit in another way.
    found.update(f"{__version__} {np.__version__} {platform.machine()}".encode())
    return found.hexdigest()
