"""The prompts for a model that writes thoughts or names places: ``configs/prompts/expert``."""

from __future__ import annotations

import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from agents.expert.writers.base import ThoughtRequest
from agents.expert.writers.facts import facts_of
from agents.expert.writers.nouns import names
from agents.expert.writers.replies import EchoCheck
from agents.vlm.chat import Message, Picture
from agents.vlm.prompt_set import interleave_pictures, without_marks
from agents.vlm.template_files import TemplateFiles
from er_gym.data.knowledge import Knowledge
from er_gym.data.trajectory import TAG_OF_KIND, Language, SeenObject
from er_gym.envs.feedback import as_now, told_in
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.task import Task

OWN_PROFILE = "expert"
"""er-gym's own set of these prompts."""
_NEEDED = ("role.jinja", "turn.jinja", "again.jinja", "places.jinja", "plan.jinja")
_MOST_IN_VIEW = 30
"""The nearest objects of a view are told."""


@dataclass(frozen=True)
class _Asked:
    """A thought that is asked for."""

    tag: str
    limit: int
    problems: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Past:
    """A turn of the history."""

    number: int
    thoughts: tuple[str, ...]
    action: str
    success: bool
    feedback: str


@dataclass(frozen=True)
class _View:
    """What is in view in a direction, ``""`` for straight ahead without looking around."""

    direction: str
    things: tuple[_Thing, ...]


@dataclass(frozen=True)
class _Thing:
    """An object in view, in words."""

    name: str
    side: str
    metres: str
    on: str
    open: bool | None
    toggled: bool | None


@dataclass(frozen=True)
class WriterPrompts:
    """The prompts in one language.

    Attributes:
        language: of the prompts and of what is written.
        files: the templates.
    """

    language: Language
    files: TemplateFiles

    @property
    def digest(self) -> str:
        """sha256 of the templates, in hex."""
        return self.files.digest

    @cached_property
    def echo_check(self) -> EchoCheck:
        """Checks that what is written does not repeat these prompts."""
        return EchoCheck.against(self.files.sources.values())

    def role(self) -> Message:
        """The system message for thoughts."""
        return Message("system", (self.files.render("role.jinja"),))

    def turn(self, request: ThoughtRequest, pictures: Sequence[Picture]) -> Message:
        """The message that asks for the thoughts of a turn.

        Args:
            request: the turn.
            pictures: what the model is shown: the view ahead, or those to the right, behind and to
                the left after looking around; none for a model that does not see.
        """
        known = request.knowledge
        text = self.files.render(
            "turn.jinja",
            pictures=len(pictures),
            directions=tuple(known.views),
            task=known.instruction,
            history=tuple(_history(known, self.language)),
            views=tuple(self._views(known)),
            held=self._named(known.held),
            decision=str(known.decision),
            verb=known.decision.verb,
            object=self._named(known.decision.object_type),
            purpose=known.purpose,
            asked=_asked(request, range(len(request.kinds)), {}),
            first=known.turn == 0,
            **self._told(known),
        )
        return Message("user", interleave_pictures(text, pictures))

    def again(self, request: ThoughtRequest, problems: Mapping[int, Sequence[str]]) -> Message:
        """The message that asks for some thoughts again, by their index, for these reasons."""
        asked = _asked(request, problems, problems)
        return Message("user", (self.files.render("again.jinja", asked=asked),))

    def places(self, thing: str, candidates: Sequence[str], number: int) -> list[Message]:
        """The conversation that asks for likely places of an object.

        Args:
            thing: the object's type.
            candidates: the types of places there are.
            number: how many to name.
        """
        text = self.files.render(
            "places.jinja",
            thing=thing,
            name=self._named(thing),
            candidates=tuple(candidates),
            number=number,
        )
        return [Message("user", (text,))]

    def told_plan(self, task: Task) -> str:
        """A task's instruction with its key actions as a hint."""
        actions = tuple(f"{key.verb} {key.actual_type}".strip() for key in task.key_actions)
        return self.files.render("plan.jinja", task=task.instruction, actions=actions)

    def _named(self, object_type: str) -> str:
        """An object type in words; what is no object type stays as it is."""
        known = names(self.language).get(object_type)
        if known is None:
            return object_type
        # Chinese names stand behind their measure word.
        return known[0].rpartition(" ")[2] if self.language == "zh" else known[0]

    def _told(self, known: Knowledge) -> dict[str, Any]:
        """The facts that hints are made of, object types in words."""
        facts = facts_of(known, random.Random(0))
        told = ("sought", "at", "last_object")
        visited = [each["o"] for each in facts.get("visited", ())]
        plan = [each["o"] for each in facts.get("plan", ())]
        return {
            **{name: self._named(facts.get(name, "")) for name in told},
            "outcome": facts["outcome"],
            "goal": facts.get("part", ""),
            "visited": tuple(map(self._named, visited)),
            "plan": tuple(map(self._named, plan)),
        }

    def _views(self, known: Knowledge) -> Iterable[_View]:
        if known.views:
            for direction, things in known.views.items():
                yield _View(direction, self._things(things))
        else:
            yield _View("", self._things(known.view))

    def _things(self, seen: Sequence[SeenObject]) -> tuple[_Thing, ...]:
        return tuple(
            _Thing(
                name=self._named(each.type),
                side=each.side,
                metres=f"{each.distance:.1f}",
                on=self._named(each.on),
                open=each.open,
                toggled=each.toggled,
            )
            for each in seen[:_MOST_IN_VIEW]
        )


def _history(known: Knowledge, language: Language) -> Iterable[_Past]:
    pairs = zip(known.actions, known.earlier, strict=True)
    for number, (done, thoughts) in enumerate(pairs, 1):
        yield _Past(
            number=number,
            thoughts=tuple(without_marks(thought.text) for thought in thoughts),
            action=str(done.action),
            success=done.success,
            feedback=without_marks(told_in(language, as_now(done.feedback))),
        )


def _asked(
    request: ThoughtRequest, chosen: Iterable[int], problems: Mapping[int, Sequence[str]]
) -> tuple[_Asked, ...]:
    return tuple(
        _Asked(
            TAG_OF_KIND[request.kinds[index]],
            request.limits[index],
            tuple(map(without_marks, problems.get(index, ()))),
        )
        for index in chosen
    )


@lru_cache(maxsize=4)
def load_writer_prompts(language: Language, profile: str = OWN_PROFILE) -> WriterPrompts:
    """The prompts in a language: er-gym's own, or those of a folder like that.

    Raises:
        ValueError: a template is missing or invalid, or Jinja is missing.
    """
    bundled = config_directory("prompts") / OWN_PROFILE
    root = bundled if profile == OWN_PROFILE else Path(profile)
    return WriterPrompts(language, TemplateFiles.read(root / language, _NEEDED))
