"""Suites: lists of tasks to be played under stated environment settings.

A bundled suite ``NAME`` is ``configs/suites/NAME.yaml`` and the task file it names, which lies in
``er_gym/tasks/data``. Any task file is a suite of its own: :func:`suite_from_file`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict

from er_gym.tasks import jsonl_format, paper_format
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import read_text, validated
from er_gym.tasks.task import Task

_PACKAGE = Path(__file__).resolve().parents[1]
_DATA = _PACKAGE / "tasks" / "data"
_READERS = {".json": paper_format.read_tasks, ".jsonl": jsonl_format.read_tasks}


@dataclass(frozen=True)
class Suite:
    """Tasks that are played and reported together.

    Attributes:
        name: of the bundled suite, or of the file without its ending.
        tasks: in the order in which they are played.
        digest: sha256, in hex, of the tasks; two runs compare only if theirs are equal.
        env: keyword arguments of ``EmbodiedEnv`` that belong to the suite.
        description: a sentence for people.
    """

    name: str
    tasks: tuple[Task, ...]
    digest: str
    env: Mapping[str, Any] = field(default_factory=dict)
    description: str = ""


class _SuiteConfig(BaseModel):
    """A file in ``configs/suites``; the suite's name is the file's."""

    model_config = ConfigDict(extra="forbid")

    description: str
    tasks: str
    env: dict[str, Any] = {}


def suite_names() -> tuple[str, ...]:
    """The names of the bundled suites, in alphabetical order."""
    return tuple(sorted(file.stem for file in _suite_configs().glob("*.yaml")))


def load_suite(name: str) -> Suite:
    """Load a bundled suite.

    Raises:
        ValueError: there is no such suite; the message lists those there are.
        TaskFileError: one of its files is damaged.
    """
    if name not in suite_names():
        raise ValueError(
            f"unknown suite {name!r}; choose one of: {', '.join(suite_names())}; "
            "or give a task file"
        )
    file = _suite_configs() / f"{name}.yaml"
    config = validated(_SuiteConfig, yaml.safe_load(read_text(file)), f"{file}: the suite")
    tasks = tuple(jsonl_format.read_tasks(_DATA / config.tasks))
    return Suite(name, tasks, jsonl_format.digest(tasks), config.env, config.description)


def suite_from_file(path: str | Path) -> Suite:
    """Make a suite of a task file: the paper's ``.json`` or our own ``.jsonl``.

    Raises:
        TaskFileError: the file cannot be used; one line says where and why.
    """
    path = Path(path)
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise TaskFileError(
            f"{path}: a task file ends in .json (the paper's format) or .jsonl (er-gym's)"
        )
    tasks = tuple(reader(path))
    return Suite(path.stem, tasks, jsonl_format.digest(tasks))


def _suite_configs() -> Path:
    """A wheel carries configs/ inside the package, a checkout has it beside the package."""
    inside = _PACKAGE / "configs" / "suites"
    return inside if inside.is_dir() else _PACKAGE.parent / "configs" / "suites"
