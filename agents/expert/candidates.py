"""Candidates for a collection: which task is played by whom, and how, drawn by the seed.

For each part and task type there is one endless sequence of candidates. How many of them are played
depends on how many are taken, but no candidate depends on another.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from random import Random
from typing import Protocol

from agents.expert.corrections import Beginning
from agents.expert.course import Course
from agents.expert.expert import CorrectedCourse, ExpertCourse
from agents.expert.explorer import ExplorerCourse, Strength
from agents.expert.kinds import ORDERED_KIND, draw_mode
from agents.expert.places import DrawnPlaces, PlaceChooser
from agents.expert.recipe import ANOMALY, CORRECTED, EXPLORED, SEARCH, Part
from agents.expert.successors import EXPERT, successor
from agents.expert.takeover import TakeoverCourse
from agents.expert.thought_kinds import ThoughtKinds
from er_gym.tasks.task import Task

_RETRIES = 3


@dataclass(frozen=True)
class Candidate:
    """A trajectory that may be taken.

    Attributes:
        id: of the trajectory; also the id under which its episode is played.
        part, actor: as the recipe has them.
        task: the task, with its own id.
        index: in the sequence of its part and task type.
        kind: of the trajectory. For a correction, the explorer's strength is drawn for its attempt.
        mode: the expert's first plan; ``search`` for an explorer that must have searched.
        explorer: the name of an explorer's strength.
        strength: how well the explorer plays.
        beginning: of the failed episode that is corrected.
        correct_by: who corrects it, see :func:`agents.expert.successors.check_corrector`.
        run: where the failed episode is, ``episode`` its key there. Of an episode that is replayed:
            the path of its run.
        repeats: the share of actions that are repeated without need.
        seed: of the episode; None for one that follows from the collection's seed.
    """

    id: str
    part: str
    actor: str
    task: Task
    index: int
    kind: str
    mode: str = ""
    explorer: str = ""
    strength: Strength | None = None
    beginning: Beginning | None = None
    correct_by: str = EXPERT
    run: str = ""
    episode: str = ""
    repeats: float = 0.0
    seed: int | None = None

    @property
    def played_task(self) -> Task:
        """The task under the candidate's own id."""
        return replace(self.task, id=self.id)

    @property
    def said_actor(self) -> str:
        """The name of the actor, as trajectories store it."""
        return f"{self.actor}:{self.explorer}" if self.explorer else self.actor

    def course(
        self,
        seed: int,
        kinds: ThoughtKinds,
        places: PlaceChooser = DrawnPlaces(),  # noqa: B008 (has no state)
    ) -> Course:
        """The course of an episode of the candidate; ``places`` chooses the expert's wrong ones."""
        random = Random(seed)
        task = self.played_task
        check = kinds.draw_check(task, random)
        if self.beginning is not None and self.correct_by != EXPERT:
            return TakeoverCourse(task, self.beginning.actions, successor(self.correct_by))
        if self.beginning is not None:
            return CorrectedCourse(task, self.beginning.actions, random, check)
        if self.strength is not None:
            must_search = self.mode == SEARCH
            return ExplorerCourse(task, self.strength, random, check, must_search=must_search)
        anomalous = self.kind == ANOMALY
        return ExpertCourse(
            task,
            "b" if anomalous else self.kind,
            self.mode,
            random,
            check=check,
            retries=_RETRIES if anomalous else 0,
            repeats=self.repeats,
            strict=None if not anomalous else False,
            places=places,
        )


class Candidates(Protocol):
    """Candidates by index."""

    @property
    def length(self) -> int | None:
        """How many there are; None for any number."""

    def __getitem__(self, index: int) -> Candidate:
        """A candidate, the same every time."""


@dataclass(frozen=True)
class FixedCandidates:
    """A finite list of candidates."""

    candidates: Sequence[Candidate]

    @property
    def length(self) -> int:
        """How many there are."""
        return len(self.candidates)

    def __getitem__(self, index: int) -> Candidate:
        return self.candidates[index]


class CandidateSequence:
    """The candidates of one part and task type, drawn without end.

    Args:
        name: the part's.
        part: as the recipe has it.
        tasks: the tasks of the type; not empty.
        seed: the collection's.
        says_part: whether ids name the part; so they must where another part has the same kinds.
    """

    length = None

    def __init__(
        self, name: str, part: Part, tasks: Sequence[Task], seed: int, *, says_part: bool = False
    ) -> None:
        self._name, self._part, self._tasks = name, part, tasks
        self._says = f"{name}-" if says_part else ""
        self._seed = f"{seed}/{name}/{tasks[0].type.name}"

    def __getitem__(self, index: int) -> Candidate:
        round_number, place = divmod(index, len(self._tasks))
        task = self._tasks[_order(f"{self._seed}/{round_number}", len(self._tasks))[place]]
        random = Random(_number(f"{self._seed}/{task.id}/{round_number}"))
        part = self._part
        kind, mode, explorer = EXPLORED, "", ""
        if part.actor == "expert":
            kind = _draw(part.kinds, random)
            if task.type.ordered and kind != ANOMALY:
                kind = ORDERED_KIND if part.kinds.get(ORDERED_KIND) else kind
            mode = draw_mode("b" if kind == ANOMALY else kind, random)
        else:
            shares = {name: strength.share for name, strength in part.explorers.items()}
            explorer = _draw(shares, random)
            kind = EXPLORED if part.actor == "explorer" else CORRECTED
            if kind == EXPLORED and random.random() >= part.direct:
                mode = SEARCH
        return Candidate(
            id=f"{task.id}-{self._says}{kind}{round_number or ''}",
            part=self._name,
            actor=part.actor,
            task=task,
            index=index,
            kind=kind,
            mode=mode,
            explorer=explorer,
            strength=part.explorers[explorer] if explorer else None,
            repeats=part.repeats,
        )


@lru_cache(maxsize=64)
def _order(seed: str, length: int) -> tuple[int, ...]:
    order = [*range(length)]
    Random(_number(seed)).shuffle(order)
    return tuple(order)


def _number(text: str) -> int:
    """A seed from a text, the same in every process."""
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")


def _draw(shares: dict[str, float], random: Random) -> str:
    names = sorted(shares)
    return random.choices(names, [shares[name] for name in names])[0]
