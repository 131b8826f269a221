"""The engine's modules import each other in one direction."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import er_gym.sim

ROOT = Path(er_gym.sim.__file__).parent


def module_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FOLDERS = ["space", "render", "actions", "data"]
"""From the ground up."""
SOURCES = {module_of(path): path for path in ROOT.rglob("*.py")}


def imports(source: str) -> Iterator[str]:
    """The engine's modules that a source imports anywhere, also late or for types only."""
    for node in ast.walk(ast.parse(source)):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            names = [
                name if name.removeprefix("er_gym.sim.") in SOURCES else node.module
                for name in inner
            ]
        for name in names:
            if name.startswith("er_gym.sim."):
                yield name.removeprefix("er_gym.sim.")


@functools.cache
def graph() -> dict[str, set[str]]:
    """Each module to those that it imports: found when a test asks, not by every process."""
    return {
        module: set(imports(path.read_text(encoding="utf-8"))) - {module}
        for module, path in SOURCES.items()
    }


def test_no_module_imports_itself_through_others() -> None:
    assert len(list(TopologicalSorter(graph()).static_order())) >= len(SOURCES)


def test_no_folder_imports_itself_through_others() -> None:
    """Each folder counts as a whole: geometry, renderer and actions stand above one another."""
    folders: dict[str, set[str]] = {}
    for module, imported in graph().items():
        folder = module.partition(".")[0]
        others = {name.partition(".")[0] for name in imported} - {folder}
        folders.setdefault(folder, set()).update(others)
    order = list(TopologicalSorter(folders).static_order())
    assert [f for f in order if f in FOLDERS] == FOLDERS
