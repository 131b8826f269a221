"""A layer imports only from those below it; DESIGN and CONTRIBUTING say why."""

from __future__ import annotations

import ast
from collections.abc import Container, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

_BASE = {
    "er_gym.activity",
    "er_gym.extras",
    "er_gym.locking",
    "er_gym.plugins",
    "er_gym.tables",
    "er_gym.writing",
}
_TASKS = {*_BASE, "er_gym.thor", "er_gym.tasks"}
_ENVS = {*_TASKS, "er_gym.envs"}
_ROLLOUT = {*_ENVS, "er_gym", "er_gym.resumable", "er_gym.rollout"}
_DATA = {*_ROLLOUT, "er_gym.data"}
_VLM = {"agents.vlm.parsing", "agents.vlm", "agents.vlm.clients"}
_OF_AGENTS = {
    "agents.configs": set(),
    "agents.zoo": set(),
    "agents.scripted.searcher": set(),
    "agents.scripted": set(),
    "agents.vlm.parsing": set(),
    "agents.vlm": {"agents.configs", "agents.vlm.parsing"},
    "agents.vlm.clients": {"agents.vlm", "agents.zoo"},
    "agents.rl": {"agents.configs", "agents.scripted", "agents.scripted.searcher"},
    "agents": {
        *("agents.configs", "agents.zoo", "agents.rl", *_VLM),
        *("agents.scripted", "agents.scripted.searcher"),
    },
    "agents.expert.writers": {"agents.scripted.searcher", "agents.vlm"},
    "agents.expert": {
        *("agents", "agents.configs", "agents.expert.writers"),
        *("agents.scripted.searcher", "agents.vlm"),
    },
    "agents.finetune": {"agents.configs", "agents.vlm", "agents.vlm.clients"},
    "agents.finetune.launchers": {"agents.configs", "agents.finetune"},
}
"""The folders of ``agents`` to the other ones that they may import, besides what is below
``agents``; ``agents`` alone is its own top-level modules."""
_AGENTS = {*_DATA, *_OF_AGENTS}
_SCORING = {*_DATA, "benchmarks.scoring", "benchmarks.terminal"}
_MONITOR = {*_AGENTS, *_SCORING, "benchmarks", "benchmarks.vlm_run", "benchmarks.monitor"}
_COMMAND = {*_MONITOR, "benchmarks.cli"}
_HARNESS = {*_COMMAND, "benchmarks.harness"}
_SCRIPTS = {*_HARNESS, "er_gym.sim", "benchmarks.perf", "benchmarks.checks", "benchmarks.pages"}
ALLOWED = {
    "er_gym.plugins": {"er_gym.plugins"},
    "er_gym.activity": set(),
    "er_gym.tables": set(),
    "er_gym.writing": {"er_gym.writing"},
    "er_gym.extras": set(),
    "er_gym.locking": _BASE,
    "er_gym.sim": {*_BASE, "er_gym.sim"},
    "er_gym.thor": {*_BASE, "er_gym.sim", "er_gym.thor"},
    "er_gym.tasks": _TASKS,
    "er_gym.envs": _ENVS,
    "er_gym": _ENVS,
    "er_gym.resumable": _TASKS,
    "er_gym.rollout": _ROLLOUT,
    "er_gym.data": _DATA,
    **{name: {*_DATA, name, *others} for name, others in _OF_AGENTS.items()},
    "benchmarks.scoring": _SCORING,
    "benchmarks.terminal": {*_ENVS, "benchmarks.terminal"},
    "benchmarks.vlm_run": _AGENTS,
    "benchmarks.monitor": _MONITOR,
    "benchmarks.cli": _COMMAND,
    "benchmarks": _COMMAND,
    "benchmarks.harness": _HARNESS,
    # Scripts that measure or check look at the engine itself.
    "benchmarks.perf": _SCRIPTS,
    "benchmarks.checks": _SCRIPTS,
    "benchmarks.pages": _SCRIPTS,
}
"""Layer to the layers that it may import; ``er_gym`` alone is its own top-level modules."""

ROOT = Path(__file__).resolve().parents[1]
SOURCES = sorted(
    path
    for package in ("er_gym", "agents", "benchmarks")
    for path in (ROOT / package).rglob("*.py")
)


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def layer(module: str) -> str | None:
    """The longest layer name that a module's name begins with; None for what is not ours."""
    fitting = (name for name in ALLOWED if module == name or module.startswith(name + "."))
    return max(fitting, key=len, default=None)


def imported_modules(source: str, package: str) -> Iterator[tuple[int, str]]:
    """Line and name of everything that a module imports, at whatever depth of its code.

    ``from a import b`` yields ``a.b``, because b may be a module.
    """
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            up = package.rsplit(".", node.level - 1)[0] + "." if node.level else ""
            base = (up + (node.module or "")).rstrip(".")
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_only_from_layers_below(path: Path) -> None:
    name = module_name(path)
    mine = layer(name)
    assert mine is not None
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    wrong = [
        f"line {line}: {mine} may not import {imported}"
        for line, imported in imported_modules(path.read_text(encoding="utf-8"), package)
        if (theirs := layer(imported)) is not None and theirs not in ALLOWED[mine]
    ]
    assert not wrong


def test_each_folder_of_the_agents_has_its_rule() -> None:
    folders = {".".join(path.parent.relative_to(ROOT).parts) for path in SOURCES}
    shared = {"agents.configs"}  # a module
    assert {each for each in folders if each.startswith("agents")} == {*_OF_AGENTS} - shared


def test_the_folders_of_the_agents_form_no_circle() -> None:
    TopologicalSorter(_OF_AGENTS).prepare()


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Late imports, and those for types alone, count too."""
    names = {module_name(path): path for path in SOURCES}
    graph: dict[str, set[str]] = {}
    for name, path in names.items():
        package = name if path.name == "__init__.py" else name.rpartition(".")[0]
        found = (
            known_module(imported, names)
            for _, imported in imported_modules(path.read_text(encoding="utf-8"), package)
        )
        graph[name] = {module for module in found if module is not None} - {name}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def known_module(imported: str, known: Container[str]) -> str | None:
    """The module of ours that an imported name is, or is part of; None for another's."""
    while imported and imported not in known:
        imported = imported.rpartition(".")[0]
    return imported or None


def test_sees_late_and_relative_imports() -> None:
    source = "def f():\n    from ..sim import scene\n    import agents.vlm\n"
    found = list(imported_modules(source, "er_gym.envs"))
    assert found == [(2, "er_gym.sim.scene"), (3, "agents.vlm")]
    assert [layer(module) for _, module in found] == ["er_gym.sim", "agents.vlm"]


def test_an_unlisted_layer_is_not_taken_for_another() -> None:
    assert layer("er_gym_extras") is None
    assert layer("numpy") is None
    assert layer("er_gym.registration") == "er_gym"
