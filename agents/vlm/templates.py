"""Prompts that are Jinja templates: ``configs/prompts``, or a directory like those.

``configs/prompts/README.md`` lists the templates and their variables.
"""

from __future__ import annotations

import hashlib
import itertools
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from agents.vlm.prompt_set import (
    THOUGHTS,
    Decide,
    LastAction,
    Sees,
    TurnContext,
    without_marks,
)
from agents.vlm.template_files import LARGEST, TemplateFiles
from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.reading import parse_yaml, read_text
from er_gym.tasks.verbs import Verb

_TEMPLATES = ("system.jinja", "first.jinja", "next.jinja", "feedback.jinja")
_ACTIONS = "actions.yaml"
_FOR_DIALECTS = ("now", "before", "directions")


@dataclass(frozen=True)
class ActionRow:
    """An action as templates list it; ``form`` is, for example, ``navigate to <object>``."""

    form: str
    meaning: str


@dataclass(frozen=True, kw_only=True)
class Templates:
    """Prompts from Jinja templates; a :class:`~agents.vlm.prompt_set.PromptSet`.

    Attributes:
        files: the templates.
        actions: the actions that prompts list.
    """

    name: str
    digest: str
    about: str
    files: TemplateFiles = field(repr=False)
    actions: tuple[ActionRow, ...] = field(repr=False)
    after_observe: int | None = field(default=None, init=False)
    as_recorded: bool = field(default=False, init=False)

    def check(self, *, decide: Decide, sees: Sees) -> None:
        """See :class:`~agents.vlm.prompt_set.PromptSet`; templates take all settings."""

    def system(self, *, decide: Decide, sees: Sees, task: str = "") -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("system.jinja", decide=decide, sees=sees)

    def first(self, turn: TurnContext) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        pictures = int(turn.sees == "pictures")
        return self._render("first.jinja", pictures=pictures, **_variables(turn))

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("next.jinja", **_variables(turn), **_variables(last_action))

    def feedback(self, *, problem: str, decide: Decide, action: str = "") -> str:
        """See :class:`~agents.vlm.prompt_set.PromptSet`."""
        return self._render("feedback.jinja", problem=problem, decide=decide)

    def _render(self, template: str, *, pictures: int = 0, **variables: Any) -> str:
        return self.files.render(
            template, pictures=pictures, actions=self.actions, thoughts=THOUGHTS, **variables
        )


def _variables(given: TurnContext | LastAction) -> dict[str, Any]:
    """What templates are told; ``configs/prompts/README.md`` lists it."""
    return {name: value for name, value in vars(given).items() if name not in _FOR_DIALECTS}


def profile_names() -> tuple[str, ...]:
    """er-gym's own profiles."""
    found = config_directory("prompts").glob("*/*/system.jinja")
    return tuple(sorted({file.parents[1].name for file in found}))


def directory_of(profile: str, language: str) -> Path:
    """The directory of a profile's templates in a language."""
    profiles = profile_names()
    root = config_directory("prompts") / profile if profile in profiles else Path(profile)
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
    files = TemplateFiles.read(directory, _TEMPLATES)
    listed = directory / _ACTIONS
    stated = read_text(listed, LARGEST)
    actions = _rows(stated, listed, directory.name)
    digest = hashlib.sha256(repr(sorted([*files.sources.items(), (_ACTIONS, stated)])).encode())
    if verbs.ADDED:
        digest.update(repr(actions).encode())
    templates = Templates(
        name=f"{directory.parent.name}/{directory.name}",
        digest=digest.hexdigest(),
        about=f"prompts of {directory}",
        files=files,
        actions=actions,
    )
    _try_out(templates)
    return templates


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
                    action="navigate to Fridge",
                    success=success,
                    pictures=pictures,
                )
                templates.next(turn, last_action)
