"""The README's examples give the output that it shows."""

from __future__ import annotations

import importlib.util
import pkgutil
import re
import shlex
import subprocess
import sys
from pathlib import Path

import click

from benchmarks.cli.main import cli
from er_gym.sim.actions import ACTIONS


def test_the_python_example_runs(repository: Path) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", (repository / "README.md").read_text(), re.S)
    done = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Task: ")
    assert " -> " in done.stdout


def test_every_picture_and_page_is_there(repository: Path) -> None:
    for link in re.findall(r"\]\(([^)#]+)\)", (repository / "README.md").read_text()):
        if "://" not in link:
            assert (repository / link).exists(), link


def test_the_list_of_actions_is_complete(repository: Path) -> None:
    page = (repository / "docs" / "fidelity.md").read_text().partition("## Actions")[2]
    assert set(re.findall(r"\w+", page)) == {*ACTIONS, "Reset"}


def commands(page: str) -> list[str]:
    """What follows ``er-gym`` in the shell examples of a page."""
    blocks = re.findall(r"```(?:sh|bash)\n(.*?)```", page.replace("\\\n", " "), re.S)
    lines = [line.partition(" #")[0] for block in blocks for line in block.splitlines()]
    found = [line.partition("er-gym ")[2] for line in lines if re.search(r"(^|[ /])er-gym ", line)]
    return [re.split(r" [|>&;]", command)[0] for command in found]


def pages(repository: Path) -> list[Path]:
    return [
        repository / "README.md",
        repository / "CONTRIBUTING.md",
        *repository.glob("docs/*.md"),
    ]


def test_commands_and_their_options_exist(repository: Path) -> None:
    found = [
        (page.name, command) for page in pages(repository) for command in commands(page.read_text())
    ]
    assert len(found) > 50
    for page, command in found:
        context, parsed, rest = click.Context(cli, info_name="er-gym"), cli, shlex.split(command)
        while isinstance(parsed, click.Group):
            if parsed.invoke_without_command and (not rest or rest[0].startswith("-")):
                break
            _, parsed, rest = parsed.resolve_command(context, rest)
            assert parsed is not None, f"{page}: er-gym {command}"
            context = click.Context(parsed, parent=context)
        parsed.make_parser(context).parse_args(rest)  # raises what a user would be told


def test_files_and_modules_exist(repository: Path) -> None:
    """Every path and every dotted name that a page has in backticks or runs with ``python -m``."""
    text = {page.name: page.read_text() for page in pages(repository)}
    groups = re.findall(r"\| `(er_gym\.\w+)` \|", text["extending.md"])  # of entry points
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
