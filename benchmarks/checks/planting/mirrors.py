"""The packages in which faults are planted, the tests that should notice, and which cannot."""

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
EQUIVALENT: Mapping[str, str] = {
    "paper_approach-2d9a97": "of a side only the sign counts: 2 is the same side as 1",
    "data_charts-9fc9a9": "at exactly 65 % either colour of the number can be read",
    "encoders-4bfac3": "how many texts an encoder remembers changes no vector",
}
"""Faults that change nothing that a user or another part can see, judged by hand: the reason, by
their ids."""


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
