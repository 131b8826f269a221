"""The requirements of extras are read from metadata, and all resolve under constraints.txt."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from support import run_python

from agents.zoo.index import find_model, model_names
from benchmarks.checks.installing import BY_THEMSELVES
from benchmarks.cli.extras import closure, installed_requires, installed_version, state_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
PROJECT: dict[str, Any] = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS: dict[str, list[str]] = PROJECT["optional-dependencies"]

NOT_PINNED = ("nvidia-", "cuda-", "triton")
"""What torch brings along on some machines, in versions that it pins itself."""


def pins() -> dict[str, str]:
    """Distribution to its version in constraints.txt, for this Python."""
    found = {}
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        if text := line.partition("#")[0].strip():
            pin = Requirement(text)
            if pin.marker is None or pin.marker.evaluate():
                name = canonicalize_name(pin.name)
                assert name not in found, f"{name} is pinned twice"
                found[name] = str(pin.specifier).removeprefix("==")
    return found


def requires_in_pyproject() -> list[str]:
    """The project's requirements as its metadata words them, read anew from pyproject.toml."""
    found = list(PROJECT["dependencies"])
    for extra, texts in EXTRAS.items():
        for text in texts:
            requirement = Requirement(text)
            marker = f'extra == "{extra}"'
            if requirement.marker is not None:
                marker = f"({requirement.marker}) and {marker}"
            requirement.marker = None
            found.append(f"{requirement}; {marker}")
    return found


@cache
def requires_in_index(name: str) -> list[str]:
    """The requirements of the pinned release of what is not installed, from the package index."""
    asked = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--no-deps"]
    asked += ["--ignore-installed", "--report", "-", f"{name}=={pins()[name]}"]
    done = subprocess.run(asked, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(
            f"{name} is not installed, nor found in the index: {done.stderr.strip()[-200:]}"
        )
    (found,) = json.loads(done.stdout)["install"]
    requires: list[str] = found["metadata"]["requires_dist"]
    return requires


def requires(name: str) -> list[str]:
    if name == "er-gym":
        return requires_in_pyproject()
    if installed_version(name) is None and name in {
        canonicalize_name(Requirement(text).name) for texts in EXTRAS.values() for text in texts
    }:
        return requires_in_index(name)
    return installed_requires(name)


@pytest.mark.parametrize("extra", [name for name in EXTRAS if name not in BY_THEMSELVES])
def test_an_extra_resolves_under_the_constraints(extra: str) -> None:
    """``python -m benchmarks.checks.installing`` has pip resolve them."""
    pinned = pins()
    reached = list(closure(extra, requires))
    assert len(reached) > len(EXTRAS[extra])
    for wanted_by, requirement in reached:
        name = canonicalize_name(requirement.name)
        if name == "er-gym" or name.startswith(NOT_PINNED):
            continue
        assert name in pinned, f"{wanted_by} wants {name}, which is not pinned"
        assert requirement.specifier.contains(pinned[name]), (
            f"{wanted_by} wants {requirement}, but {pinned[name]} is pinned"
        )


def test_the_core_resolves_under_the_constraints() -> None:
    pinned = pins()
    for text in PROJECT["dependencies"]:
        core = Requirement(text)
        assert core.specifier.contains(pinned[canonicalize_name(core.name)]), core
        for transitive in map(Requirement, installed_requires(core.name)):
            if transitive.marker is None or transitive.marker.evaluate({"extra": ""}):
                name = canonicalize_name(transitive.name)
                assert transitive.specifier.contains(pinned[name]), f"{core.name}: {transitive}"


# -- the state of an extra -------------------------------------------------------------------------

HERE = 'python_version >= "3.10"'
ELSEWHERE = 'python_version >= "4.0"'


def made_of(**requirements: list[str]) -> Callable[[str], list[str]]:
    """Requirements by distribution; what is not given is asked of the real metadata."""
    given = {name.replace("_", "-"): texts for name, texts in requirements.items()}
    return lambda name: given[name] if name in given else installed_requires(name)


def test_a_complete_extra_lists_what_is_there() -> None:
    state = state_of("x", made_of(er_gym=["pytest>=8; extra == 'x'", "numpy", "gone; extra=='y'"]))
    assert state.complete
    assert state.packages == (f"pytest {pytest.__version__}",)


def test_what_is_missing_is_found_at_any_depth() -> None:
    state = state_of(
        "all",
        made_of(
            er_gym=["er-gym[x,y]; extra == 'all'", "pytest; extra == 'x'", "no-b[z]; extra=='y'"],
            pytest=["pluggy", "No_Such.Thing>=2", "er-gym[all]"],  # a circle, too
            no_b=["no-c; extra == 'z'", "no-d; extra == 'w'", f"no-e; {ELSEWHERE}"],
        ),
    )
    assert set(state.missing) == {"No_Such.Thing", "no-b", "no-c"}
    assert not state.complete


def test_a_version_that_a_dependency_refuses_is_found() -> None:
    """As when inspect-ai is installed beside a newer fsspec than it takes."""
    state = state_of(
        "x", made_of(er_gym=["pytest; extra == 'x'"], pytest=["pluggy<=0.1", "iniconfig>=1"])
    )
    assert not state.missing
    assert state.wrong == (f"pluggy is {installed_version('pluggy')}, but pytest wants <=0.1",)


def test_what_this_python_cannot_have_is_named() -> None:
    requirements = [
        f"pytest; {HERE} and extra == 'x'",
        f"later>=3; {ELSEWHERE} and extra == 'x'",
        "stand-in; python_version < '3.1' and extra == 'x'",  # needed no more
        "er-gym[x]; extra == 'all'",
    ]
    for extra in ("x", "all"):
        state = state_of(extra, made_of(er_gym=requirements))
        assert state.unsupported == (f"later (for {ELSEWHERE})",)
        assert (state.missing, state.complete) == ((), False)


# -- other distributions' packages -----------------------------------------------------------------


def install_beside(folder: Path, distribution: str, package: str) -> None:
    """Put there what pip would: a distribution with one package."""
    info = folder / f"{distribution.replace('-', '_')}-1.2.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {distribution}\nVersion: 1.2\n")
    (info / "RECORD").write_text(f"{package}/__init__.py,,\n{info.name}/RECORD,,\n")
    (folder / package).mkdir()
    (folder / package / "__init__.py").write_text("")


def packages_here(*path: Path) -> dict[str, tuple[bool, bool, str]]:
    """What doctor says of the top-level packages: works, needed, says; in a Python with a path."""
    program = (
        "import json; from benchmarks.cli.doctor_checks import _packages\n"
        "print(json.dumps({c.part: (c.works, c.required, c.detail + c.fix) for c in _packages()}))"
    )
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))}
    asked = [sys.executable, "-c", program]  # which puts the working directory before the path
    done = subprocess.run(asked, capture_output=True, text=True, env=env, cwd=path[0])
    assert done.returncode == 0, done.stderr
    return {what: tuple(found) for what, found in json.loads(done.stdout).items()}


def test_another_distribution_with_a_package_of_our_name_is_found(tmp_path: Path) -> None:
    here = packages_here(ROOT)
    assert here["package agents"][0]
    assert here["package benchmarks"][0]
    install_beside(tmp_path, "openai-agents", "agents")
    behind = packages_here(ROOT, tmp_path)
    works, needed, says = behind["package agents"]
    assert (works, needed) == (False, False)
    assert "openai-agents 1.2" in says
    assert "virtual environment" in says
    assert behind["package benchmarks"][0]


def test_a_second_opencv_is_named(tmp_path: Path) -> None:
    install_beside(tmp_path, "opencv-python-headless", "cv2")
    works, needed, says = packages_here(ROOT, tmp_path)["package cv2"]
    assert (works, needed) == (False, False)
    assert "opencv-python " in says
    assert "opencv-python-headless 1.2" in says
    assert "pip uninstall --yes opencv-python opencv-python-headless && pip install" in says


def test_another_package_in_place_of_ours_is_an_error(tmp_path: Path) -> None:
    install_beside(tmp_path, "openai-agents", "agents")
    works, needed, says = packages_here(tmp_path, ROOT)["package agents"]
    assert (works, needed) == (False, True)
    assert f"imports {tmp_path}" in says
    assert "openai-agents 1.2" in says


# -- errors that name an extra ---------------------------------------------------------------------

ON_A_CORE = """
import json, sys
from importlib.metadata import packages_distributions
from packaging.utils import canonicalize_name
core = set(json.loads(sys.argv[1]))
owners = packages_distributions()

class Core:
    "Finds nothing that the core does not bring."
    def find_spec(self, name, path=None, target=None):
        of = {canonicalize_name(each) for each in owners.get(name.partition(".")[0], ())}
        if of and not of & core:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Core())
from agents import make_agent
for name in json.loads(sys.argv[2]):
    try:
        make_agent(name)
    except ValueError as error:
        print(json.dumps(str(error)))
"""


def of_the_core() -> set[str]:
    """The distributions that an installation without extras brings."""
    found, new = (
        {"er-gym"},
        {canonicalize_name(Requirement(each).name) for each in PROJECT["dependencies"]},
    )
    while new:
        found |= new
        wanted = [Requirement(text) for name in new for text in installed_requires(name)]
        new = {
            canonicalize_name(each.name)
            for each in wanted
            if each.marker is None or each.marker.evaluate({"extra": ""})
        } - found
    return found


def test_an_agent_names_the_extra_that_is_enough_for_it(tmp_path: Path) -> None:
    """Not that of the first package which it happens to miss."""
    needs = {"openai:model": "vlm", f"recorded:{tmp_path}": "vlm", f"hf:{tmp_path}": "local"}
    needs |= {f"rl:{tmp_path}": "rl"}
    needs |= {f"zoo:{name}": find_model(name).player.extra for name in model_names()}
    names = json.dumps(sorted(of_the_core())), json.dumps(list(needs))
    told = run_python(ON_A_CORE, *names).stdout.splitlines()
    for name, message in zip(needs, map(json.loads, told), strict=True):
        assert name in message
        assert message.endswith(f"which is not installed: pip install 'er-gym[{needs[name]}]'")
