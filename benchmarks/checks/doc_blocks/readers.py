"""Reads the blocks that are no programs, each as that does which it is for."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

from benchmarks.checks.doc_blocks.blocks import Part
from benchmarks.harness.output import ROOT


def _settings(text: str, folder: Path) -> None:
    from agents.factory import load_settings

    file = folder / "settings.yaml"
    file.write_text(text, encoding="utf-8")
    load_settings(str(file))


def _recipes(text: str, folder: Path) -> None:
    from er_gym.tasks.generate.recipes import read_recipes

    file = folder / "recipes.yaml"
    file.write_text(text, encoding="utf-8")
    (recipe,) = read_recipes(file)
    shipped = ROOT / "er_gym" / "tasks" / "generate" / "recipes.yaml"
    if recipe not in read_recipes(shipped):
        raise ValueError(f"{shipped} has another recipe {recipe.name}")


def _rewards(text: str, folder: Path) -> None:
    import yaml

    from agents.reinforce.settings import ReinforceSettings

    ReinforceSettings.model_validate(yaml.safe_load(text))


def _cluster(text: str, folder: Path) -> None:
    """KubeRay's own reader is not here, so this is only read as YAML, and its version compared."""
    from importlib.metadata import PackageNotFoundError, version

    import yaml

    spec = yaml.safe_load(text)["spec"]
    try:
        installed = version("ray")
    except PackageNotFoundError:
        return
    if spec["rayVersion"] != installed:
        raise ValueError(f"rayVersion is {spec['rayVersion']}, and {installed} is installed")


def _entry_points(text: str, folder: Path) -> None:
    """Each group is in the page's table, and each name in a file that the page shows."""
    if sys.version_info < (3, 11):
        return
    import tomllib

    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    for group, names in tomllib.loads(text)["project"]["entry-points"].items():
        if f"| `{group}` |" not in page:
            raise ValueError(f"there is no group {group}")
        for name in names.values():
            module, _, attribute = name.partition(":")
            file = f"# {module.replace('.', '/')}.py\n"
            shown = page.partition(file)[2].partition("```")[0]
            if not re.search(rf"^(?:class )?{attribute}\b", shown, re.MULTILINE):
                raise ValueError(f"no file of the page has {name}")


def _reply(text: str, folder: Path) -> None:
    from agents.vlm.parsing.reply import parse

    parsed = parse(text)
    if not parsed.verb:
        raise ValueError(f"the reply is not understood: {parsed}")


def _folders(text: str, folder: Path) -> None:
    for line in text.splitlines():
        if not (ROOT / line.split()[0]).is_dir():
            raise ValueError(f"there is no folder {line.split()[0]}")


def _task_file(text: str, folder: Path) -> None:
    from er_gym.tasks.suites import suite_from_file

    file = folder / "tasks.jsonl"
    file.write_text(text, encoding="utf-8")
    suite_from_file(file)


READERS: Mapping[str, Callable[[str, Path], None]] = {
    "CONTRIBUTING.md: er_gym/sim": _folders,
    "docs/agents.md: <Observation>": _reply,
    "docs/cluster.md: apiVersion": _cluster,
    "docs/extending.md: [project.entry-points": _entry_points,
    'docs/recipes.md: {"format"': _task_file,
    "docs/reinforcement.md: rewards:": _rewards,
    "docs/serving.md: server:": _settings,
    "docs/tasks.md: - name:": _recipes,
}
"""What reads a block, by its page and the words with which it begins. It raises an error of any
kind; it may write into the folder that it is given."""


def reader(part: Part) -> Callable[[str, Path], None] | None:
    """What reads a block that is no program; None if nothing does."""
    for row, reads in READERS.items():
        page, _, words = row.partition(": ")
        if part.page == page and part.text.startswith(words):
            return reads
    return None
