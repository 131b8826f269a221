"""A layer imports only from those below it; DESIGN and CONTRIBUTING say why."""

from __future__ import annotations

import ast
import functools
from collections import defaultdict
from collections.abc import Container, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from support import in_one_test

_BASE = {
    "er_gym.activity",
    "er_gym.extras",
    "er_gym.locking",
    "er_gym.plugins",
    "er_gym.shared_library",
    "er_gym.tables",
    "er_gym.version",
    "er_gym.writing",
}
_TASKS = {*_BASE, "er_gym.houses", "er_gym.thor", "er_gym.tasks"}
_ENVS = {*_TASKS, "er_gym.envs"}
_ROLLOUT = {*_ENVS, "er_gym.resumable", "er_gym.rollout"}
_DATA = {*_ROLLOUT, "er_gym", "er_gym.data"}
_INTEGRATIONS = {*_DATA, "er_gym.integrations"}
_VLM = {"agents.vlm.parsing", "agents.vlm", "agents.vlm.clients"}
_OF_AGENTS = {
    "agents.configs": set(),
    "agents.zoo": set(),
    "agents.scripted.searcher": set(),
    "agents.scripted": set(),
    "agents.vlm.parsing": set(),
    "agents.vlm": {"agents.configs", "agents.vlm.parsing"},
    "agents.vlm.clients": {"agents.vlm", "agents.zoo"},
    "agents.rl": {
        *("agents.configs", "agents.scripted", "agents.scripted.searcher", "agents.zoo"),
    },
    "agents": {
        *("agents.configs", "agents.zoo", "agents.rl", *_VLM),
        *("agents.scripted", "agents.scripted.searcher"),
    },
    "agents.expert.writers": {"agents.scripted.searcher", "agents.vlm"},
    "agents.expert": {
        *("agents", "agents.configs", "agents.expert.writers", "agents.zoo"),
        *("agents.scripted.searcher", "agents.vlm"),
    },
    "agents.finetune": {"agents.configs", "agents.vlm", "agents.vlm.clients"},
    "agents.reinforce": {"agents.configs", "agents.finetune", "agents.vlm", "agents.vlm.clients"},
    "agents.finetune.launchers": {"agents.configs", "agents.finetune"},
}
"""The folders of ``agents`` to the other ones that they may import, besides what is below
``agents``; ``agents`` alone is its own top-level modules."""
_AGENTS = {*_DATA, *_OF_AGENTS}
_SCORING = {*_DATA, "benchmarks.scoring", "benchmarks.terminal"}
_STUDY = {*_AGENTS, *_SCORING, "benchmarks.study"}
_MONITOR = {*_STUDY, "benchmarks.vlm_run", "benchmarks.monitor"}
_COMMAND = {
    *(*_MONITOR, "er_gym.integrations", "benchmarks.unity"),
    *("benchmarks", "benchmarks.leaderboard", "benchmarks.cli"),
}
_HARNESS = {*_COMMAND, "benchmarks.harness"}
_SCRIPTS = {*_HARNESS, "er_gym.sim", "benchmarks.perf", "benchmarks.checks", "benchmarks.pages"}
ALLOWED = {
    "er_gym.plugins": {"er_gym.plugins"},
    "er_gym.activity": set(),
    "er_gym.tables": set(),
    "er_gym.version": set(),
    "er_gym.writing": {"er_gym.writing"},
    "er_gym.extras": set(),
    "er_gym.shared_library": {"er_gym.writing"},
    "er_gym.locking": _BASE,
    "er_gym.sim": {*_BASE, "er_gym.sim"},
    "er_gym.houses": {*_BASE, "er_gym.sim", "er_gym.houses"},
    "er_gym.thor": {*_BASE, "er_gym.houses", "er_gym.sim", "er_gym.thor"},
    "er_gym.tasks": _TASKS,
    "er_gym.envs": _ENVS,
    "er_gym.resumable": _TASKS,
    "er_gym.rollout": _ROLLOUT,
    # What the package offers by itself; it imports most of that when it is asked for.
    "er_gym": _ROLLOUT,
    "er_gym.data": _DATA,
    "er_gym.integrations": _INTEGRATIONS,
    **{name: {*_DATA, name, *others} for name, others in _OF_AGENTS.items()},
    "benchmarks.scoring": _SCORING,
    "benchmarks.terminal": {*_ENVS, "benchmarks.terminal"},
    "benchmarks.study": _STUDY,
    "benchmarks.unity": {*_DATA, "benchmarks.unity"},
    "benchmarks.leaderboard": {*_STUDY, "benchmarks.leaderboard"},
    "benchmarks.vision_probe": {*_COMMAND, "benchmarks.vision_probe"},
    "benchmarks.vlm_run": _AGENTS,
    "benchmarks.monitor": _MONITOR,
    "benchmarks.cli": _COMMAND,
    "benchmarks": {*_AGENTS, *_SCORING, "benchmarks", "benchmarks.vlm_run"},
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


def imports_of(path: Path) -> list[tuple[int, str]]:
    """Line and name of everything that a file of ours imports."""
    name = module_name(path)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    return [*imported_modules(path.read_text(encoding="utf-8"), package)]


@functools.cache
def all_imports() -> dict[Path, list[tuple[int, str]]]:
    """Found when a test asks, not in every process that collects the tests."""
    return {path: imports_of(path) for path in SOURCES}


@in_one_test("path", SOURCES)
def test_imports_only_from_layers_below(path: Path) -> None:
    mine = layer(module_name(path))
    assert mine is not None
    wrong = [
        f"line {line}: {mine} may not import {imported}"
        for line, imported in all_imports()[path]
        if (theirs := layer(imported)) is not None and theirs not in ALLOWED[mine]
    ]
    assert not wrong


@pytest.mark.parametrize("top", ["agents", "benchmarks"])
def test_each_folder_has_its_rule(top: str) -> None:
    folders = {".".join(path.parent.relative_to(ROOT).parts) for path in SOURCES}
    inside = {each for each in folders if each.startswith(f"{top}.")}
    assert {each for each in inside if layer(each) == top} == set()


def imported_by_module() -> dict[str, set[str]]:
    """Each module of ours to those that it imports; late imports, and those for types alone,
    count too."""
    names = {module_name(path) for path in SOURCES}
    return {
        (name := module_name(path)): {
            module
            for _, imported in all_imports()[path]
            if (module := known_module(imported, names)) not in (None, name)
        }
        for path in SOURCES
    }


def test_no_module_imports_itself_by_way_of_others() -> None:
    assert circle_in(imported_by_module()) == ""


def test_the_files_and_folders_of_a_folder_import_one_another_in_one_direction() -> None:
    """Each folder is a room whose doors all open the same way."""
    graphs: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for module, others in imported_by_module().items():
        for other in others:
            package, one, two = where_they_part(module, other)
            if package and one and two:
                graphs[package][f"{package}.{one}"].add(f"{package}.{two}")
    assert [circle for graph in graphs.values() if (circle := circle_in(graph))] == []


def where_they_part(one: str, other: str) -> tuple[str, str, str]:
    """The innermost folder that holds two modules, and the file or folder in it of each."""
    parts, others = one.split("."), other.split(".")
    same = next(
        (
            place
            for place, pair in enumerate(zip(parts, others, strict=False))
            if pair[0] != pair[1]
        ),
        min(len(parts), len(others)),
    )
    return ".".join(parts[:same]), "".join(parts[same : same + 1]), "".join(others[same : same + 1])


def circle_in(graph: dict[str, set[str]]) -> str:
    """A circle of imports in words; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return " imports ".join(reversed(error.args[1]))
    return ""


def test_a_circle_is_seen() -> None:
    assert circle_in({"a": {"b"}, "b": {"c"}, "c": {"a"}}).count("imports") == 3
    assert where_they_part("x.a.b", "x.c") == ("x", "a", "c")
    assert where_they_part("x", "x.c") == ("x", "", "c")


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
