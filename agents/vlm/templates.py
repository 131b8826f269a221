"""Prompts that are Jinja templates: ``configs/prompts``, or a directory like those.

``configs/prompts/README.md`` lists the templates and their variables.
"""

from __future__ import annotations

import hashlib
import itertools
import traceback
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from agents.vlm.prompt_set import (
    IMAGE,
    IMAGE_MARK,
    THOUGHTS,
    Decide,
    LastAction,
    Sees,
    TurnContext,
    without_marks,
)
from er_gym.tasks import verbs
from er_gym.tasks.reading import parse_yaml, read_text
from er_gym.tasks.suites import config_directory
from er_gym.tasks.verbs import Verb

if TYPE_CHECKING:
    from agents.vlm.sandbox import BoundedEnvironment

_TEMPLATES = ("system.jinja", "first.jinja", "next.jinja", "feedback.jinja")
_ACTIONS = "actions.yaml"
_LARGEST = 1 << 16
"""The largest template, in bytes."""
_LONGEST = 200_000
"""The longest turn, in characters."""


@dataclass(frozen=True)
class ActionRow:
    """An action as templates list it; ``form`` is, for example, ``navigate to <object>``."""

    form: str
    meaning: str


@dataclass(frozen=True, kw_only=True)
class Templates:
    """Prompts from Jinja templates; a :class:`~agents.vlm.prompt_set.PromptSet`.

    Attributes:
        files: the path of each template, by name.
        actions: the actions that prompts list.
    """

    name: str
    digest: str
    about: str
    files: Mapping[str, Path] = field(repr=False)
    actions: tuple[ActionRow, ...] = field(repr=False)
    after_observe: int | None = field(default=None, init=False)
    environment: BoundedEnvironment = field(repr=False, compare=False)

    def system(self, *, decide: Decide, sees: Sees) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("system.jinja", decide=decide, sees=sees)

    def first(self, turn: TurnContext) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("first.jinja", pictures=int(turn.sees == "pictures"), **vars(turn))

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("next.jinja", **vars(turn), **vars(last_action))

    def feedback(self, *, problem: str, decide: Decide) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("feedback.jinja", problem=problem, decide=decide)

    def _render(self, template: str, *, pictures: int = 0, **variables: Any) -> str:
        given = {
            name: without_marks(value) if isinstance(value, str) else value
            for name, value in variables.items()
        }
        self.environment.begin()
        try:
            text = self.environment.get_template(template).render(
                **given, pictures=pictures, actions=self.actions, thoughts=THOUGHTS
            )
        except Exception as error:  # a template can raise anything
            raise ValueError(
                f"{self._place(error, template)}: {type(error).__name__}: "
                f"{' '.join(str(error).split())}"
            ) from None
        text = text.strip()
        if len(text) > _LONGEST:
            raise ValueError(
                f"{self.files[template]}: makes a turn of {len(text):,} characters; "
                f"{_LONGEST:,} are allowed"
            )
        if text.count(IMAGE_MARK) != pictures:
            raise ValueError(
                f"{self.files[template]}: {IMAGE} occurs {text.count(IMAGE_MARK)} times, but "
                f"{{{{ pictures }}}} is {pictures}; write it once for each picture"
            )
        return text

    def _place(self, error: Exception, template: str) -> str:
        """The file in which a template failed, with the line if it is known."""
        places = {str(path) for path in self.files.values()}
        lines = [
            f"{frame.filename}:{frame.lineno}"
            for frame in traceback.extract_tb(error.__traceback__)
            if frame.filename in places
        ]
        return lines[-1] if lines else str(self.files[template])


def directory_of(profile: str, language: str) -> Path:
    """The directory of a profile's templates in a language."""
    bundled = config_directory("prompts")
    profiles = sorted({file.parents[1].name for file in bundled.glob("*/*/system.jinja")})
    root = bundled / profile if profile in profiles else Path(profile)
    languages = sorted(file.parent.name for file in root.glob("*/system.jinja"))
    if not languages:
        raise ValueError(
            f"there are no prompts {profile!r}; give a directory that has LANGUAGE/system.jinja, "
            f"or one of: {', '.join(profiles)}"
        )
    if language not in languages:
        raise ValueError(
            f"the prompts {profile!r} do not exist in {language!r}; choose one of: "
            f"{', '.join(languages)}"
        )
    return root / language


def load_templates(directory: Path) -> Templates:
    """Read the templates of a directory, and render each once as a check."""
    files = {file.name: file for file in sorted(directory.glob("*.jinja"))}
    missing = {*_TEMPLATES} - files.keys()
    if missing:
        raise ValueError(f"{directory} lacks {min(missing)}; copy it from another set of prompts")
    listed = directory / _ACTIONS
    sources = {file.name: read_text(file, _LARGEST) for file in (*files.values(), listed)}
    actions = _rows(sources[_ACTIONS], listed, directory.name)
    digest = hashlib.sha256(repr(sorted(sources.items())).encode())
    if verbs.ADDED:
        digest.update(repr(actions).encode())
    templates = Templates(
        name=f"{directory.parent.name}/{directory.name}",
        digest=digest.hexdigest(),
        about=f"prompts of {directory}",
        files=files,
        actions=actions,
        environment=_environment(files, sources),
    )
    _try_out(templates)
    return templates


def _environment(files: Mapping[str, Path], sources: Mapping[str, str]) -> BoundedEnvironment:
    """The environment of templates that were read once, so that the digest fits what is
    rendered."""
    try:
        from jinja2 import FunctionLoader, StrictUndefined, TemplateSyntaxError

        from agents.vlm.sandbox import BoundedEnvironment
    except ImportError as error:
        raise ValueError(
            f"prompts need {error.name}, which is not installed: pip install 'er-gym[vlm]'"
        ) from error

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


def _rows(text: str, file: Path, language: str) -> tuple[ActionRow, ...]:
    """The actions and their meanings in the file's order, then the verbs of other packages that the
    file does not explain."""
    meanings = parse_yaml(text, str(file))
    own = [verb.name for verb in verbs.OWN]
    added = {verb.name: _meaning(verb, language) for verb in verbs.ADDED}
    if not isinstance(meanings, dict) or not {*own} <= {*meanings} <= {*own, *added}:
        known = ", ".join((*own, *added))
        raise ValueError(f"{file}: give the meanings of these actions, and of no others: {known}")
    return tuple(
        ActionRow(
            f"{verb} <object>" if verb in verbs.OBJECT_VERBS else verb, without_marks(str(words))
        )
        for verb, words in {**meanings, **(added | meanings)}.items()
    )


def _meaning(verb: Verb, language: str) -> str:
    """The meaning of an added verb: in the prompts' language, else in English, else its name."""
    stated = (verb.words[each].meaning for each in (language, "en") if each in verb.words)
    return next(filter(None, stated), f"{verb.name}{'' if verb.alone else ' an object'}.")


def _try_out(templates: Templates) -> None:
    """Render every template once, so that errors show before the first episode."""
    shown: dict[Sees, tuple[int, ...]] = {"pictures": (1, 4), "text": (0,)}
    for decide in get_args(Decide):
        templates.feedback(problem="It does not name an action.", decide=decide)
        for sees, numbers in shown.items():
            templates.system(decide=decide, sees=sees)
            turn = TurnContext(task="Find a Mug.", decide=decide, sees=sees, max_steps=20)
            templates.first(turn)
            for pictures, success in itertools.product(numbers, (True, False)):
                last_action = LastAction(
                    action="navigate to Fridge", success=success, pictures=pictures
                )
                templates.next(turn, last_action)
