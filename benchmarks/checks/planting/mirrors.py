"""The packages in which faults are planted, and the tests that should notice."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

_FOLDERS: Mapping[str, tuple[str, str]] = {
    "er_gym/envs": ("tests/envs", ""),
    "er_gym/data": ("tests/data", ""),
    "agents/expert": ("tests/agents/expert", ""),
    "benchmarks/scoring": ("tests/benchmarks", r"benchmarks\.scoring|\"(stats|show)\""),
}
"""The folder of tests that mirrors each package, and what a file of it must say to be about it."""
PACKAGES = tuple(_FOLDERS)


def tests_of(root: Path, package: str) -> list[str]:
    """The files or folders of tests that mirror a package."""
    folder, about = _FOLDERS[package]
    if not about:
        return [folder]
    return [
        path.relative_to(root).as_posix()
        for path in sorted((root / folder).glob("test_*.py"))
        if re.search(about, path.read_text(encoding="utf-8"))
    ]
