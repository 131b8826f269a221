"""Suites: lists of tasks with the environment settings under which they are played.

A suite ``NAME`` is ``configs/suites/NAME.yaml`` and the task file that it names. The task file
comes with er-gym, in ``er_gym/tasks/data``, or ``er-gym tasks generate`` writes it to
:func:`suite_home`. Any task file can be played as a suite, too: :func:`suite_from_file`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from er_gym.plugins import PluginError, Registry, error_line
from er_gym.tasks import jsonl_format, paper_format
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.errors import SetAsideTask, TaskFileError, summarise_set_aside
from er_gym.tasks.files import validated
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.suite_spec import SuiteSpec
from er_gym.tasks.task import Task
from er_gym.tasks.wordings.instructions import Language, in_language

_PACKAGE = Path(__file__).resolve().parents[1]
_LONGEST_QUOTE = 80
"""The most characters of a name that a message quotes."""
_DATA = _PACKAGE / "tasks" / "data"
_READERS = {
    ".json": paper_format.read_file,
    ".jsonl": jsonl_format.read_file,
    ".jsonl.gz": jsonl_format.read_file,
}


@dataclass(frozen=True)
class Suite:
    """Tasks that are played and reported together.

    Attributes:
        name: the name of the suite, or of the file without its ending.
        tasks: in the order in which they are played.
        digest: sha256, in hex, of the tasks; only runs with equal digests can be compared.
        env: keyword arguments of ``EmbodiedEnv`` that belong to the suite.
        description: a sentence for people.
        set_aside: tasks of the file that cannot be used, and why.
        places: the number of each task in the file, from 1; empty for a bundled suite.
    """

    name: str
    tasks: tuple[Task, ...]
    digest: str
    env: Mapping[str, Any] = field(default_factory=dict)
    description: str = ""
    set_aside: tuple[SetAsideTask, ...] = ()
    places: tuple[int, ...] = ()


class SuiteConfig(BaseModel):
    """A file in ``configs/suites``; the suite's name is the file's.

    Attributes:
        description: a sentence for people.
        tasks: the name of the task file.
        versions: how the digest of each version of the tasks begins, the oldest first; the last one
            is that of the tasks now. A suite's version changes with its tasks alone.
        env: keyword arguments of ``EmbodiedEnv``.
        generate: which tasks to generate.
        seed: the seed of the generator.
    """

    model_config = ConfigDict(extra="forbid")

    description: str
    tasks: str
    versions: tuple[str, ...] = ()
    env: dict[str, Any] = {}
    generate: SuiteSpec | None = None
    seed: int = 0


def suite_names() -> tuple[str, ...]:
    """The names of er-gym's own suites, in alphabetical order."""
    return tuple(sorted(file.stem for file in config_directory("suites").glob("*.yaml")))


def suite_registry() -> Registry[Suite | Callable[[], Suite]]:
    """All suites by name: er-gym's own, then those of other packages."""
    return Registry(
        kind="suite",
        group="er_gym.suites",
        own={name: partial(_own_suite, name) for name in suite_names()},
        expected=f"an {__name__}.Suite, or a function that makes one",
        fits=lambda suite: isinstance(suite, Suite) or callable(suite),
        others="or give a task file",
    )


def load_suite(name: str, language: Language | None = None) -> Suite:
    """Load a suite: er-gym's own or another package's by its name, or ``package.module:function``.

    Args:
        name: of the suite; ``NAME-zh`` is er-gym's suite ``NAME`` in Chinese.
        language: of the instructions; None for the suite's own.

    Raises:
        ValueError: there is no such suite, and the message lists the known suites; or one of its
            tasks cannot be told in the language.
        TaskFileError: one of its files is damaged, or the suite has not been generated yet.
    """
    if language is not None:
        return told_in(load_suite(name), language)
    own, _, code = name.rpartition("-")
    if code == "zh" and own in suite_names():
        return load_suite(own, "zh")
    found = suite_registry().get(name)
    if name in suite_names() and not isinstance(found, Suite):
        return found()
    try:
        suite = found if isinstance(found, Suite) else found()
    except Exception as error:  # another package's code can raise anything
        raise PluginError(
            f"suite {name!r} cannot be made ({error_line(error)}); it is called without arguments"
        ) from error
    if not isinstance(suite, Suite):
        raise PluginError(f"suite {name!r} makes {type(suite).__name__}; give an {__name__}.Suite")
    return suite


def told_in(suite: Suite, language: Language) -> Suite:
    """The suite with its instructions in a language; in Chinese it is named ``NAME-zh``.

    Raises:
        ValueError: one of its tasks cannot be told in it.
    """
    tasks = in_language(suite.tasks, language)
    if tasks == suite.tasks:
        return suite
    return replace(
        suite,
        name=suite.name.removesuffix("-zh") + ("" if language == "en" else f"-{language}"),
        tasks=tasks,
        digest=jsonl_format.digest(tasks),
    )


def own_tasks(name: str) -> tuple[Task, ...]:
    """The tasks of one of er-gym's own suites, in two thirds of the time of :func:`load_suite`,
    which computes a digest of them the first time.

    Raises:
        ValueError, TaskFileError: see :func:`load_suite`.
    """
    return _read_own(*_own_file(name))


def _own_file(name: str) -> tuple[Path, int]:
    """The task file of one of er-gym's own suites, and when it was changed."""
    file = suite_file(name)
    if not file.exists():
        raise TaskFileError(
            f"the suite {name!r} does not come with er-gym and is not in {file.parent} yet; "
            f"run: er-gym tasks generate --suite {name}"
        )
    return file, file.stat().st_mtime_ns


@lru_cache(maxsize=4)
def _read_own(file: Path, changed: int) -> tuple[Task, ...]:
    return tuple(jsonl_format.read_tasks(file))


@lru_cache(maxsize=4)
def _digest_of_own(file: Path, changed: int) -> str:
    return jsonl_format.digest(_read_own(file, changed))


def comes_with_er_gym(suite: Suite) -> bool:
    """Whether each task of a suite is one of a suite that comes with er-gym, unchanged but for its
    instruction.

    The embedded engine has every object of such tasks: each was played before it was kept.
    """
    name = suite.name.removesuffix("-zh")
    if name not in suite_names() or suite_file(name).parent != _DATA:
        return False
    own = {task.id: task for task in own_tasks(name)}
    return all(
        (same := own.get(task.id)) is not None
        and task.key_actions is same.key_actions  # read from the same file
        and (task is same or replace(task, instruction=same.instruction) == same)
        for task in suite.tasks
    )


def _own_suite(name: str) -> Suite:
    config, file = suite_config(name), _own_file(name)
    tasks, digest = _read_own(*file), _digest_of_own(*file)
    return Suite(name, tasks, digest, config.env, config.description)


def suite_config(name: str) -> SuiteConfig:
    """The content of ``configs/suites/NAME.yaml``.

    Raises:
        ValueError: there is no such suite; the message lists the known suites.
        TaskFileError: the file is damaged.
    """
    if name not in suite_names():
        raise PluginError(suite_registry().unknown(name[:_LONGEST_QUOTE]))
    file = config_directory("suites") / f"{name}.yaml"
    return validated(SuiteConfig, read_yaml(file), f"{file}: the suite")


def suite_version(name: str, digest: str) -> int | None:
    """The version, from 1, of er-gym's suite of a name whose tasks have a digest; None for other
    tasks."""
    if name not in suite_names():
        return None
    versions = suite_config(name).versions
    return next((n for n, each in enumerate(versions, 1) if digest.startswith(each)), None)


def suite_file(name: str) -> Path:
    """The path of a suite's task file: in er-gym, else in :func:`suite_home`, even if missing."""
    tasks = suite_config(name).tasks
    bundled = _DATA / tasks
    return bundled if bundled.exists() else suite_home() / tasks


def suite_home() -> Path:
    """The folder of the suites that do not come with er-gym.

    It is ``$ER_GYM_HOME/suites``, else ``$XDG_DATA_HOME/er-gym/suites``, else
    ``~/.local/share/er-gym/suites``.
    """
    home = os.environ.get("ER_GYM_HOME")
    if home:
        return Path(home) / "suites"
    data = os.environ.get("XDG_DATA_HOME")
    return (Path(data) if data else Path.home() / ".local" / "share") / "er-gym" / "suites"


def suite_from_file(path: str | Path) -> Suite:
    """Load a task file as a suite: the paper's ``.json``, or er-gym's ``.jsonl`` or ``.jsonl.gz``.

    Faulty tasks are set aside (``Suite.set_aside``).

    Raises:
        TaskFileError: the file or all of its tasks cannot be used; one line says where and why.
    """
    path = Path(path)
    ending = next((end for end in _READERS if path.name.lower().endswith(end)), "")
    if not ending:
        raise TaskFileError(
            f"{path}: a task file ends in .json (the paper's format), "
            ".jsonl or .jsonl.gz (er-gym's)"
        )
    found = _READERS[ending](path)
    if found.set_aside and not found.tasks:
        raise TaskFileError(f"{path}: no task can be used: {summarise_set_aside(found.set_aside)}")
    return Suite(
        name=path.name[: -len(ending)],
        tasks=found.tasks,
        digest=jsonl_format.digest(found.tasks),
        set_aside=found.set_aside,
        places=found.places,
    )
