"""``er-gym prompts``: the texts of prompts, and copies of them to be changed."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import FOLDER, force_option
from benchmarks.terminal import echo


@dataclass(frozen=True)
class _Kind:
    """A kind of texts.

    Attributes:
        about: whom they are for.
        folder: the one of ``configs`` that holds a set of it.
        used: how a copy is named, with ``{}`` for its folder.
    """

    about: str
    folder: str
    used: str


_AGENT = _Kind(
    "what a model that plays is told",
    "prompts",
    "er-gym bench --suite mini --agent openai:MODEL --set prompts.profile={}",
)
_WRITER = _Kind(
    "what a model that writes thoughts is told",
    "prompts",
    "er-gym collect --suite train --expert openai:MODEL --set prompts.profile={}",
)
_DIALECT = _Kind(
    "a dialect: the words of training files, and of models that were tuned on them",
    "dialects",
    "er-gym data export COLLECTION --to FORMAT --out FILES --dialect {}",
)


@click.group(invoke_without_command=True)
@click.pass_context
def prompts(context: click.Context) -> None:
    """List the sets of prompts for models, or copy one to change it."""
    if context.invoked_subcommand is not None:
        return
    sets = _sets()
    widest = max(map(len, sets))
    for name, kind in sets.items():
        languages = ", ".join(_languages(_folder(name, kind)))
        echo(f"{name:{widest}}  {languages}  {kind.about}")
    echo("\nA copy to change: er-gym prompts copy DIR --from NAME")


@prompts.command()
@click.argument("directory", metavar="DIR", type=FOLDER)
@click.option(
    "--from",
    "name",
    default="default",
    show_default=True,
    metavar="NAME",
    help="The set that is copied, of those that er-gym prompts lists.",
)
@force_option
def copy(directory: Path, name: str, force: bool) -> None:
    """Copy a set of prompts into a folder, to change it and play with it.

    README.md in the folder says which text is used where, and what a template may say. A file that
    is there already and differs, such as one that you changed, is not replaced without --force.
    """
    from er_gym.writing import check_output, make_folder, write_output

    sets = _sets()
    if name not in sets:
        raise BadInput(f"there are no prompts {name!r:.80}; choose one of: {', '.join(sets)}")
    kind = sets[name]
    source = _folder(name, kind)
    files = {
        path.relative_to(source): path.read_bytes()
        for path in sorted(source.rglob("*"))
        if path.is_file()
    }
    files[Path("README.md")] = (source.parent / "README.md").read_bytes()
    with bad_input():
        for folder in sorted({(directory / file).parent for file in files}):
            make_folder(folder)
        for file, data in files.items():  # all or none
            check_output(directory / file, data, force=force)
        for file, data in files.items():
            write_output(directory / file, data, force=force)
    echo(f"{len(files)} files in {directory}; README.md says what they are")
    echo(f"  {kind.used.format(shlex.quote(str(directory)))}")


def _sets() -> Mapping[str, _Kind]:
    """All sets by name."""
    from agents.vlm.templates import profile_names
    from er_gym.data.dialects import dialect_names

    return {
        **dict.fromkeys(profile_names(), _AGENT),
        "expert": _WRITER,
        **dict.fromkeys(dialect_names(), _DIALECT),
    }


def _folder(name: str, kind: _Kind) -> Path:
    from er_gym.tasks.config_folder import config_directory

    return config_directory(kind.folder) / name


def _languages(folder: Path) -> list[str]:
    return sorted({path.stem for path in folder.iterdir()})
