"""A thought that is being checked, and what the agent knows about its objects."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any

from er_gym.data.knowledge import Knowledge
from er_gym.data.mentions import Mention, all_interchangeable, named_in
from er_gym.data.phrases import Phrases
from er_gym.data.reading import PHRASES, Clause, read
from er_gym.data.splitting import parts_of
from er_gym.data.trajectory import SeenObject
from er_gym.thor import OBJECT_TYPES


@dataclass(frozen=True)
class Refusal:
    """Why a thought is refused.

    Attributes:
        code: the sort of fault, such as ``unseen``, ``side``, ``state``, ``decision``.
        detail: a sentence for the writer: what was claimed, and what is true.
    """

    code: str
    detail: str


@dataclass(frozen=True)
class Thought:
    """A thought that is being checked.

    Attributes:
        text: as it was written; ``limit``: the most words.
        kind: the kind that was asked for.
        known: what the agent knew.
    """

    text: str
    kind: str
    limit: int
    known: Knowledge

    @cached_property
    def phrases(self) -> Phrases:
        """The phrases of its language."""
        return PHRASES[self.known.language]

    @cached_property
    def clauses(self) -> tuple[Clause, ...]:
        """What it says."""
        return read(self.text, self.known.language)

    @cached_property
    def parts(self) -> tuple[Clause, ...]:
        """The clauses, split further by polarity."""
        return tuple(part for each in self.clauses for part in parts_of(each, self.phrases))

    @cached_property
    def sentences(self) -> Mapping[int, str]:
        """The text of each sentence, as its clauses have it."""
        between = "" if self.known.language == "zh" else " "
        return {
            number: between.join(each.text for each in clauses)
            for number, clauses in groupby(self.clauses, lambda each: each.sentence)
        }

    @cached_property
    def kept(self) -> dict[str, Any]:
        """What its readers derive once, by their names for it."""
        return {}

    @cached_property
    def views(self) -> Mapping[str, Sequence[SeenObject]]:
        """The objects in view by direction, ``ahead`` being the agent's own."""
        return {"ahead": self.known.view, **self.known.views}

    @cached_property
    def in_view(self) -> frozenset[str]:
        """The types in view, those alike included."""
        return all_interchangeable(self.known.in_view)

    @cached_property
    def seen(self) -> frozenset[str]:
        """The types that are or were in view, or are in the hand, those alike included."""
        known = self.known
        taken = (each.action.object_type for each in known.actions if each.success)
        types = (*known.seen, *known.in_view, known.held, *taken)
        return all_interchangeable(each for each in types if each in OBJECT_TYPES) | {"Floor"}

    @cached_property
    def held(self) -> frozenset[str]:
        """The type in the hand, those alike included; empty for none."""
        return all_interchangeable([self.known.held]) if self.known.held else frozenset()

    @cached_property
    def mentionable(self) -> frozenset[str]:
        """The types that may be spoken of as existing: seen, named, or offered as targets."""
        known = self.known
        places = (each.place for each in known.visits)
        own = (known.decision.object_type, known.subgoal.thing, known.subgoal.place, known.at)
        types = (
            *(*known.navigable, *known.interactable, *known.plan, *places, *own),
            *named_in(known.instruction),
        )
        return self.seen | all_interchangeable(each for each in types if each in OBJECT_TYPES)

    def things(self, types: Iterable[str]) -> Iterator[tuple[str, SeenObject]]:
        """The objects of some types that are in view, each with its direction."""
        wanted = all_interchangeable(types)
        for direction, view in self.views.items():
            for each in view:
                if each.type in wanted:
                    yield direction, each

    def are_several(self, types: Iterable[str]) -> bool:
        """Whether several objects of some types are in view; one may be in two views."""
        return len({(each.type, each.distance) for _, each in self.things(types)}) > 1

    def done(self, verb: str, types: frozenset[str]) -> bool:
        """Whether the agent did that to one of some types."""
        wanted = all_interchangeable(types)
        return any(
            each.success and each.action.verb == verb and each.action.object_type in wanted
            for each in self.known.actions
        )


def name_of(mention: Mention) -> str:
    """A name as it stands in the thought, in quotes."""
    return f"“{mention.text}”"
