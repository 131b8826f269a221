"""What the pages name is there. Their blocks are run by tests/benchmarks/test_doc_blocks.py."""

from __future__ import annotations

import importlib.util
import pkgutil
import re
import runpy
import shlex
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import pytest

from benchmarks.checks.doc_blocks.blocks import SHELL, Part, blocks, pages
from benchmarks.cli.extras import extras
from benchmarks.cli.main import cli
from er_gym import __version__
from er_gym.sim.actions import ACTIONS, perform
from er_gym.sim.actions.refused import REFUSED
from er_gym.sim.errors import WrongCall
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.world import World


@pytest.mark.parametrize("page", ["README.md", "README.zh.md"])
def test_every_picture_and_page_is_there(repository: Path, page: str) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", (repository / page).read_text("utf-8")):
        if "://" not in link:
            assert (repository / link).exists(), link


def test_an_index_shows_the_readme_without_a_link_to_nowhere(
    repository: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Only what builds er-gym has hatchling.
    hatch = SimpleNamespace(MetadataHookInterface=object)
    monkeypatch.setitem(sys.modules, "hatchling.metadata.plugin.interface", hatch)
    readable = runpy.run_path(str(repository / "hatch_build.py"))["readable_anywhere"]
    readme = (repository / "README.md").read_text("utf-8")
    links = re.findall(r"\]\(([^)]+)\)", readme)
    elsewhere = [each for each in links if "://" in each]
    inside = [each for each in links if "://" not in each]
    assert len(inside) > 20
    alone = readable(readme, "", "1.2")
    assert re.findall(r"\]\(([^)]+)\)", alone) == elsewhere
    assert "docs/results.md has the oracle" in alone
    assert "![" not in alone
    found = re.findall(r"\]\(([^)]+)\)", readable(readme, "https://example.org/x", "1.2"))
    assert len(found) == len(links)
    assert [each for each in found if not each.startswith("http")] == []
    assert "https://example.org/x/blob/v1.2/docs/start.md" in found
    assert "https://example.org/x/raw/v1.2/docs/images/rooms.jpg" in found


def test_the_table_of_actions_tells_what_each_does(repository: Path) -> None:
    page = (repository / "docs" / "fidelity.md").read_text().partition("## Actions")[2]
    rows = re.findall(r"^\| (`.*`) \| (.*) \|$", page, re.MULTILINE)
    told = {name: here for names, here in rows for name in re.findall(r"`(\w+)`", names)}
    assert sum(len(re.findall("`", names)) for names, _ in rows) == 2 * len(told)  # none twice
    refused = {name: here for name, here in told.items() if here.startswith("refused: ")}
    assert told.keys() - refused.keys() == {*ACTIONS, "Reset"}
    assert refused == {name: f"refused: {reason}" for name, reason in REFUSED.items()}
    assert f"{len(ACTIONS) + 1} are taken here, and {len(REFUSED)} are refused" in page


def test_each_refused_action_says_why() -> None:
    world = World.load(load_scene("FloorPlan402"), Settings())
    for name, reason in REFUSED.items():
        with pytest.raises(WrongCall, match=re.escape(f"Invalid action: {name}.")) as refusal:
            perform(world, {"action": name, "anything": 1})
        assert str(refusal.value).endswith(f"{reason}.")
        assert str(refusal.value).count(". ") == 1


def commands(part: Part) -> list[str]:
    """What follows ``er-gym`` in a part of a shell block."""
    lines = [line.partition(" #")[0] for line in part.text.splitlines()]
    found = [line.partition("er-gym ")[2] for line in lines if re.search(r"(^|[ /])er-gym ", line)]
    return [re.split(r" [|>&;]", command)[0] for command in found]


def test_commands_and_their_options_exist(repository: Path) -> None:
    found = [
        (part.place, command)
        for block in blocks(repository)
        if block.language in SHELL
        for part in block.parts
        for command in commands(part)
    ]
    assert len(found) > 50
    for place, command in found:
        context, parsed, rest = click.Context(cli, info_name="er-gym"), cli, shlex.split(command)
        while isinstance(parsed, click.Group):
            if parsed.invoke_without_command and (not rest or rest[0].startswith("-")):
                break
            _, parsed, rest = parsed.resolve_command(context, rest)
            assert parsed is not None, f"{place}: er-gym {command}"
            context = click.Context(parsed, parent=context)
        parsed.make_parser(context).parse_args(rest)  # raises what a user would be told


def test_files_and_modules_exist(repository: Path) -> None:
    """Every path and every dotted name that a page has in backticks or runs with ``python -m``."""
    text = {
        str(page.relative_to(repository)): page.read_text(encoding="utf-8")
        for page in pages(repository)
    }
    groups = re.findall(r"\| `(er_gym\.\w+)` \|", text["docs/extending.md"])  # of entry points
    files = [
        (page, found)
        for page, words in text.items()
        for found in re.findall(
            r"`((?:er_gym|agents|benchmarks|configs|examples|tests)/[\w./-]+)`", words
        )
    ]
    names = [
        (page, found)
        for page, words in text.items()
        for found in re.findall(r"`((?:er_gym|agents|benchmarks)(?:\.\w+)+)", words)
        if found not in groups
    ]
    scripts = [
        (page, found)
        for page, words in text.items()
        for found in re.findall(r"python -m ((?:er_gym|benchmarks)[\w.]+)", words)
    ]
    assert min(len(files), len(names), len(scripts)) > 10
    assert [each for each in files if not (repository / each[1]).exists()] == []
    assert [each for each in scripts if importlib.util.find_spec(each[1]) is None] == []
    for page, name in names:
        try:
            pkgutil.resolve_name(name)
        except (ImportError, AttributeError) as error:
            raise AssertionError(f"{page}: {name}") from error


def test_what_is_said_to_install_extras_works_in_a_checkout(repository: Path) -> None:
    """An environment that a block makes lacks er-gym: it gets er-gym from the checkout."""
    wanted = [
        (part.page, name)
        for part in blocks(repository)
        for names in re.findall(r"pip install '(?:er-gym|\.)\[([\w,-]+)\]'", part.text)
        for name in names.split(",")
    ]
    assert len(wanted) > 10
    assert [each for each in wanted if each[1] not in extras()] == []
    made = [part for part in blocks(repository) if "-m venv" in part.text and "[" in part.text]
    assert len(made) > 5
    assert [part.place for part in made if "er-gym[" in part.text] == []


def test_the_citation_names_the_version(repository: Path) -> None:
    assert f"\nversion: {__version__}\n" in (repository / "CITATION.cff").read_text("utf-8")


def test_the_chinese_page_has_the_same_commands_links_and_figures(repository: Path) -> None:
    here, there = ((repository / page).read_text("utf-8") for page in ("README.md", "README.zh.md"))
    for pattern in (
        r"^(?:er-gym|make) [a-z][^#\n]*[^#\s]",  # commands, without what is said of them
        r"^(?:import|env|obs|done|while|    \w)[^#\n]*[^#\s]",  # the program
        r"\]\((?!README)([^)]+)\)",
        r"\d+\.\d(?: \([\d. to]+\))? \|",
        r"`ER-[\w-]+`|`examples/[\w.]+`",
    ):
        assert re.findall(pattern, here, re.MULTILINE) == re.findall(pattern, there, re.MULTILINE)
