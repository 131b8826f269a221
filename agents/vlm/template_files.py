"""Jinja templates of one directory, read once and rendered in a sandbox."""

from __future__ import annotations

import hashlib
import traceback
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.vlm.prompt_set import IMAGE, IMAGE_MARK, without_marks
from er_gym.extras import MissingPackage
from er_gym.tasks.reading import read_text

if TYPE_CHECKING:
    from agents.vlm.sandbox import BoundedEnvironment

LARGEST = 1 << 16
"""The largest template, in bytes."""
_LONGEST = 200_000
"""The longest turn, in characters."""


@dataclass(frozen=True)
class TemplateFiles:
    """The templates of a directory.

    Attributes:
        paths: the path of each template, by name.
        sources: their texts, by name.
    """

    paths: Mapping[str, Path] = field(repr=False)
    sources: Mapping[str, str] = field(repr=False)
    environment: BoundedEnvironment = field(repr=False, compare=False)

    @classmethod
    def read(cls, directory: Path, needed: Iterable[str]) -> TemplateFiles:
        """Read all ``.jinja`` files of a directory.

        Raises:
            ValueError: one of ``needed`` is not there, a template is invalid, or Jinja is missing.
            TaskFileError: a file cannot be read. (It is a ValueError.)
        """
        paths = {file.name: file for file in sorted(directory.glob("*.jinja"))}
        missing = {*needed} - paths.keys()
        if missing:
            raise ValueError(
                f"{directory} lacks {min(missing)}; copy it from another set of prompts"
            )
        sources = {name: read_text(path, LARGEST) for name, path in paths.items()}
        return cls(paths, sources, _environment(paths, sources))

    @property
    def digest(self) -> str:
        """sha256 of the texts, in hex."""
        return hashlib.sha256(repr(sorted(self.sources.items())).encode()).hexdigest()

    def render(self, template: str, *, pictures: int = 0, **variables: Any) -> str:
        """A template's text, with an :data:`~agents.vlm.prompt_set.IMAGE_MARK` for each picture.

        Raises:
            ValueError: the template fails, its text is too long, or it does not mark all pictures.
        """
        given = {
            name: without_marks(value) if isinstance(value, str) else value
            for name, value in variables.items()
        }
        self.environment.begin()
        try:
            text = self.environment.get_template(template).render(**given, pictures=pictures)
        except Exception as error:  # a template can raise anything
            raise ValueError(
                f"{self._place(error, template)}: {type(error).__name__}: "
                f"{' '.join(str(error).split())}"
            ) from None
        text = text.strip()
        if len(text) > _LONGEST:
            raise ValueError(
                f"{self.paths[template]}: makes a turn of {len(text):,} characters; "
                f"{_LONGEST:,} are allowed"
            )
        if text.count(IMAGE_MARK) != pictures:
            raise ValueError(
                f"{self.paths[template]}: {IMAGE} occurs {text.count(IMAGE_MARK)} times, but "
                f"{{{{ pictures }}}} is {pictures}; write it once for each picture"
            )
        return text

    def _place(self, error: Exception, template: str) -> str:
        """The file in which a template failed, with the line if it is known."""
        places = {str(path) for path in self.paths.values()}
        lines = [
            f"{frame.filename}:{frame.lineno}"
            for frame in traceback.extract_tb(error.__traceback__)
            if frame.filename in places
        ]
        return lines[-1] if lines else str(self.paths[template])


def _environment(files: Mapping[str, Path], sources: Mapping[str, str]) -> BoundedEnvironment:
    """The environment of templates that were read once, so that the digest fits what is
    rendered."""
    try:
        from jinja2 import FunctionLoader, StrictUndefined, TemplateSyntaxError

        from agents.vlm.sandbox import BoundedEnvironment
    except ImportError as error:
        raise MissingPackage("a set of prompts", str(error.name), "er-gym[vlm]") from error

    def source(name: str) -> tuple[str, str, None] | None:
        if name not in files:
            return None
        return without_marks(sources[name]).replace(IMAGE, IMAGE_MARK), str(files[name]), None

    environment = BoundedEnvironment(
        loader=FunctionLoader(source),
        undefined=StrictUndefined,
        autoescape=False,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    for name, file in files.items():
        environment.begin()
        try:
            environment.get_template(name)
        except TemplateSyntaxError as error:
            problem = " ".join((error.message or "").split())
            raise ValueError(f"{file}:{error.lineno}: not a valid template: {problem}") from None
        except Exception as error:  # RecursionError, SyntaxError, OverflowError: nested too deeply
            problem = " ".join(str(error).split())[:200]
            raise ValueError(
                f"{file}: not a valid template: {type(error).__name__}: {problem}"
            ) from None
    return environment
