"""What ``import er_gym`` and ``import agents`` offer."""

from __future__ import annotations

import inspect
import pydoc
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import agents
import er_gym

OFFERED = {
    "EmbodiedEnv",
    "Task",
    "__version__",
    "load_suite",
    "make_controller",
    "play_episode",
    "thor_executable",
}
LATE = """
import sys
import gymnasium, er_gym
assert "ER-SinglePickup-v0" in gymnasium.registry
late = ("ai2thor", "er_gym.envs.embodied_env", "er_gym.rollout", "torch")
print([name for name in late if name in sys.modules])
"""


def test_dir_shows_what_is_offered_and_nothing_else() -> None:
    assert {*dir(er_gym)} == OFFERED == {*er_gym.__all__}
    assert {*dir(agents)} == {*agents.__all__}
    assert "make_agent" in dir(agents)


def test_a_star_import_gives_the_same() -> None:
    found: dict[str, object] = {}
    exec("from er_gym import *", found)
    assert {*found} - {"__builtins__"} == OFFERED
    assert all(inspect.getdoc(found[name]) for name in OFFERED - {"__version__"})


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'er_gym' has no attribute 'EmbodyedEnv'"):
        _ = er_gym.EmbodyedEnv


def test_type_checkers_see_the_names() -> None:
    source = inspect.getsource(er_gym)
    for_types = source.partition("if TYPE_CHECKING:\n")[2].partition("\n\n")[0]
    imports = re.findall(r"^    from ([\w.]+) import (.+)$", for_types, re.MULTILINE)
    modules = {name: module for module, names in imports for name in names.split(", ")}
    assert modules == er_gym._LAZY
    assert {*modules, "__version__"} == OFFERED


def test_what_is_heavy_is_imported_when_it_is_used() -> None:
    done = subprocess.run([sys.executable, "-c", LATE], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_help_is_a_page_that_names_what_is_offered(repository: Path) -> None:
    page = pydoc.render_doc(er_gym, renderer=pydoc.plaintext)
    page = page.partition("PACKAGE CONTENTS")[0]
    assert 20 < len(page.splitlines()) < 60
    assert [name for name in OFFERED - {"__version__"} if f"``{name}" not in page] == []
    for place in re.findall(r"``((?:examples|docs)/[\w.]*|README.md)``", page):
        assert (repository / place).exists()


@pytest.mark.parametrize("module", [er_gym, agents], ids=["er_gym", "agents"])
def test_the_lines_of_the_page_run(module: object, capsys: pytest.CaptureFixture[str]) -> None:
    block = re.search(r"::\n\n((?:    .*\n|\n)+)", str(module.__doc__))
    assert block is not None
    named: dict[str, object] = {}
    exec(textwrap.dedent(block[1]), named)
    if module is er_gym:
        assert capsys.readouterr().out.startswith("Task: ")
        assert named["info"]["action_success"]  # type: ignore[index]
    else:
        assert named["record"].task_id == named["task"].id  # type: ignore[attr-defined]
    named["env"].close()  # type: ignore[attr-defined]
