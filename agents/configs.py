"""YAML files that a user chooses by name or path, checked, with overrides from the command line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel

from er_gym.tasks.files import validated
from er_gym.tasks.reading import parse_yaml, read_yaml
from er_gym.tasks.suites import config_directory

Settings = TypeVar("Settings", bound=BaseModel)


def names(kind: str) -> tuple[str, ...]:
    """The names of the files of ``configs/KIND``, in alphabetical order."""
    return tuple(sorted(file.stem for file in config_directory(kind).glob("*.yaml")))


def file_of(kind: str, name: str, what: str) -> Path:
    """The file of a path, or of the name of one that comes with er-gym.

    Args:
        kind: the directory of ``configs``.
        what: what such a file is, for the message.

    Raises:
        ValueError: there is none; the message lists those that come with er-gym.
    """
    if name in names(kind):
        return config_directory(kind) / f"{name}.yaml"
    if not Path(name).is_file():
        raise ValueError(
            f"there is no {what} {name!r}; give a YAML file, or one of: {', '.join(names(kind))}"
        )
    return Path(name)


def load(
    model: type[Settings],
    file: Path | None,
    what: str,
    overrides: Sequence[str] = (),
    more: Mapping[str, Any] | None = None,
) -> Settings:
    """Read a YAML file.

    Args:
        model: what it has to be.
        file: its path; all defaults for None.
        what: what such a file is, for messages.
        overrides: ``"env.types=[single_search]"``: a field's path and its value in YAML.
        more: fields by name, overruling these in turn.

    Raises:
        ValueError: an override is none, or has no such field; what is given does not fit.
        TaskFileError: the file cannot be read. (It is a ValueError.)
    """
    data = {} if file is None else _read(file, what)
    for text in overrides:
        path, equals, value = text.partition("=")
        if not (equals and path):
            raise ValueError(f"{text!r} is no override; give NAME=VALUE")
        _put(data, path.split("."), parse_yaml(value, f"--set {text:.60}"), text)
    where = f"{file}: the {what}" if file else f"the {what}"
    return validated(model, {**data, **(more or {})}, where)


def _read(file: Path, what: str) -> dict[str, Any]:
    data = read_yaml(file)
    if not isinstance(data, dict):
        raise ValueError(f"{file}: a {what} is a table of settings, not {data!r:.60}")
    return data


def _put(data: dict[str, Any], path: Sequence[str], value: Any, text: str) -> None:
    *way, last = path
    for name in way:
        inner = data.setdefault(name, {})
        if not isinstance(inner, dict):
            raise ValueError(f"override {text!r}: {name!r} is {inner!r}, which has no fields")
        data = inner
    data[last] = value


def dump(settings: BaseModel) -> str:
    """The YAML of settings, with every default written out."""
    return yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
