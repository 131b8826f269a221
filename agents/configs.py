"""Loads YAML files by name or path, validates them, and applies command-line overrides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict

from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.files import validated
from er_gym.tasks.reading import parse_yaml, read_yaml

Settings = TypeVar("Settings", bound=BaseModel)


class StrictSettings(BaseModel):
    """Settings that refuse unknown names and numbers that are not finite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def names(kind: str) -> tuple[str, ...]:
    """The names of the files of ``configs/KIND``, in alphabetical order."""
    return tuple(sorted(file.stem for file in config_directory(kind).glob("*.yaml")))


def file_of(kind: str, name: str, what: str) -> Path:
    """The path of a configuration file, given its path or the name of one of er-gym's own.

    Args:
        kind: the directory of ``configs``.
        name: a name in that directory, or a path.
        what: what such a file describes, for the message.

    Raises:
        ValueError: the file does not exist; the message lists er-gym's own.
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
    beneath: Path | None = None,
) -> Settings:
    """Read and validate a YAML file.

    Args:
        model: the pydantic model of the settings.
        file: the path; None for all defaults.
        what: what such a file describes, for messages.
        overrides: ``"env.types=[single_search]"``: a field's path and its value in YAML.
        more: fields by name, which take precedence over the overrides.
        beneath: another file, whose fields hold where the first does not state them.

    Raises:
        ValueError: an override has no ``=`` or names an unknown field, or a value is invalid.
        TaskFileError: the file cannot be read. (It is a ValueError.)
    """
    data = {} if file is None else _read(file, what)
    if beneath is not None:
        data = _merged(_read(beneath, what), data)
    for text in overrides:
        path, equals, value = text.partition("=")
        if not (equals and path):
            raise ValueError(f"{text!r} is not an override; give NAME=VALUE")
        _put(data, path.split("."), parse_yaml(value, f"--set {text:.60}"), text)

    def where(field: str) -> str:
        for text in reversed(overrides):
            name = text.partition("=")[0]
            if field == name or field.startswith(f"{name}."):
                return f"--set {text:.80}: the {what}"
        return f"{file}: the {what}" if file else f"the {what}"

    return validated(model, {**data, **(more or {})}, where)


@dataclass(frozen=True)
class ConfigKind(Generic[Settings]):
    """A kind of configuration file, of which er-gym has some of its own.

    Attributes:
        model: the pydantic model of the settings.
        folder: the directory of ``configs`` with er-gym's own.
        what: what such a file describes, for messages.
    """

    model: type[Settings]
    folder: str
    what: str

    def names(self) -> tuple[str, ...]:
        """The names of er-gym's own files, in alphabetical order."""
        return names(self.folder)

    def file(self, name: str) -> Path:
        """The path of a file, given it or the name of one of er-gym's own; see :func:`file_of`."""
        return file_of(self.folder, name, self.what)

    def load(self, name: str, overrides: Sequence[str] = ()) -> Settings:
        """Read a file by its path or by the name of one of er-gym's own.

        Raises:
            ValueError: the file does not exist, or the file or an override is invalid.
        """
        return load(self.model, self.file(name), self.what, overrides)


def _read(file: Path, what: str) -> dict[str, Any]:
    data = read_yaml(file)
    if not isinstance(data, dict):
        raise ValueError(f"{file}: a {what} is a table of settings, not {data!r:.60}")
    return data


def _merged(beneath: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Two tables of settings as one; tables within them are merged, too."""
    found = {**beneath, **above}
    for name in beneath.keys() & above.keys():
        if isinstance(beneath[name], dict) and isinstance(above[name], dict):
            found[name] = _merged(beneath[name], above[name])
    return found


def _put(data: dict[str, Any], path: Sequence[str], value: Any, text: str) -> None:
    *way, last = path
    for name in way:
        inner = data.setdefault(name, {})
        if not isinstance(inner, dict):
            raise ValueError(f"override {text!r}: {name!r} is {inner!r}, which has no fields")
        data = inner
    data[last] = value


def dump(settings: BaseModel) -> str:
    """The settings as YAML, with all defaults written out."""
    return yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
