"""The table of plugs."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from packaging.requirements import Requirement
from test_dependencies import PROJECT

from er_gym.integrations.plugs import PLUGS, Plug, installed, lacks

ROOT = Path(__file__).resolve().parents[2]
NUMBERS = Plug(
    name="numbers",
    title="Numbers",
    module="er_gym.integrations.numbers",
    requires=("numpy>=1.0",),
    tried="numpy 2.0",
    page="docs/integrations/numbers.md",
    extra="numbers",
)


def test_each_row_is_true() -> None:
    assert [plug.name for plug in PLUGS] == sorted(plug.name for plug in PLUGS)
    for plug in PLUGS:
        assert find_spec(plug.module) is not None, plug
        assert (ROOT / plug.page).is_file(), plug
        assert bool(plug.extra) != bool(plug.apart), plug
        if plug.extra:
            extra = map(Requirement, PROJECT["optional-dependencies"][plug.extra])
            assert set(map(Requirement, plug.requires)) <= set(extra), plug


def test_each_module_has_a_row_and_each_page_a_module() -> None:
    own = {"__init__", "plugs", "scaffold", "session"}
    own |= {"conversation", "trl_reading", "trl_text", "verb_tools"}  # parts of plugs
    folder = ROOT / "er_gym/integrations"
    there = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
    rows = {plug.module.rpartition(".")[2] for plug in PLUGS}
    assert there - {*own, "__pycache__"} == rows
    pages = {f"docs/integrations/{path.name}" for path in ROOT.glob("docs/integrations/*.md")}
    assert pages - {"docs/integrations/README.md"} == {plug.page for plug in PLUGS}


def test_what_a_plug_lacks() -> None:
    assert list(lacks(NUMBERS)) == []
    assert installed(NUMBERS).startswith("numpy ")
    lacking = ("numpy>=999", "no-such-distribution", "numpy<1; python_version < '3'")
    told = list(lacks(Plug(**{**vars(NUMBERS), "requires": lacking})))
    assert told[0].startswith("numpy is ")
    assert told[0].endswith("wanted is >=999")
    assert told[1] == "no-such-distribution missing"
    assert told[2] == 'this Python cannot have numpy (for python_version < "3")'


def test_how_to_install_it() -> None:
    assert NUMBERS.install == "pip install 'er-gym[numbers]'"
    apart = Plug(**{**vars(NUMBERS), "extra": "", "apart": "it pins numpy 1.0"})
    assert apart.install == "it pins numpy 1.0 (docs/integrations/numbers.md)"
