"""Plays the trajectories of ``er-gym collect`` anew, beside a replay: what was decided, and why.

All that scripted agents decide, and what the grounded writer writes, follows from the seed of an
episode, and which episode that is from the collection's recipe and seed. So whatever they record
can be derived (:class:`Reenacting`); of a model's decisions and words it cannot.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from pydantic import ValidationError

from agents.expert.candidates import Candidate, CandidateSequence
from agents.expert.corrections import Beginning
from agents.expert.course import Course
from agents.expert.players import PlaySettings, header_of
from agents.expert.prescreen import ATTEMPT
from agents.expert.recipe import Recipe
from agents.expert.replayed import ReplayedCourse
from agents.expert.successors import EXPERT, RecordedTakesOver, check_corrector
from agents.expert.takeover import TakeoverCourse
from agents.expert.thinker import ThinkingAgent
from agents.expert.thought_kinds import ThoughtKinds
from agents.expert.writers.registry import checked_grounded
from agents.zoo.index import PREFIX
from benchmarks.reenacted import Attempt, DecidedCourse, Reenacted, Witness
from er_gym.data.collection import CollectionError, CollectionManifest
from er_gym.data.line_index import Line
from er_gym.data.train_rule import QUOTING
from er_gym.data.trajectory import Trajectory
from er_gym.tasks.errors import first_problem
from er_gym.tasks.task import Task

GROUNDED = "grounded"
_HEADER = ("kind", "mode", "actor", "correction")
_ROUND = re.compile(r"(\d*)\Z")


@dataclass(frozen=True)
class Drawn:
    """What a collection's seed has drawn for a trajectory.

    Attributes:
        kind, mode, explorer: as :class:`~agents.expert.candidates.Candidate` has them.
    """

    kind: str
    mode: str = ""
    explorer: str = ""


@dataclass(frozen=True)
class Reenacting:
    """Makes the reenactments of a collection; :class:`er_gym.data.reenactment.Reenact`.

    Attributes:
        drawn: by id, what the seed has drawn; empty where the trajectories come from runs.
    """

    drawn: Mapping[str, Drawn] = field(default_factory=dict)

    def __call__(
        self, manifest: CollectionManifest, task: Task, trajectory: Trajectory
    ) -> Reenacted | None:
        """See :class:`er_gym.data.reenactment.Reenact`."""
        told = _told(manifest)
        if told is None:
            return None
        drawn = self.drawn.get(trajectory.id, Drawn(trajectory.kind))
        candidate = told.candidate(task, trajectory, drawn)
        header = {name: getattr(header_of(candidate, told.play), name) for name in _HEADER}
        if told.selects:
            del header["actor"]  # the run's agent
        writer = checked_grounded() if told.writes(trajectory) else None
        witness = Witness(trajectory.turns, writer)
        agent = ThinkingAgent(
            _course(candidate, trajectory, told),
            header_of(candidate, told.play),
            told.play.kinds,
            witness,
            None,
            trajectory.seed,
        )
        attempt = told.attempt(candidate, trajectory)
        return Reenacted(header, task, None if told.model_plans else agent, witness, attempt)

    def writes(self, manifest: CollectionManifest, trajectory: Trajectory) -> bool:
        """See :class:`er_gym.data.reenactment.Reenact`."""
        told = _told(manifest)
        return told is not None and told.writes(trajectory)


def reenacting(
    manifest: CollectionManifest, tasks: Sequence[Task], lines: Sequence[Line]
) -> Reenacting:
    """How the agents of a collection decide.

    Args:
        manifest: the collection's.
        tasks: the suite's tasks that can be played, of the collection's types and scenes.
        lines: of the trajectories.
    """
    told = _told(manifest)
    if told is None or told.from_runs:
        return Reenacting()
    if told.model_decides:
        return Reenacting({line.id: Drawn("model") for line in lines})
    by_id = {task.id: task for task in tasks}
    rounds: dict[tuple[str, str, int], dict[str, Drawn]] = {}
    drawn = {}
    for line in lines:
        if line.task_id not in by_id or line.part not in told.recipe.parts:
            continue
        number = int("0" + _ROUND.findall(line.id.removeprefix(line.task_id))[0])
        key = line.part, by_id[line.task_id].type.name, number
        if key not in rounds:
            rounds[key] = _round(told, tasks, *key, manifest.seed)
        drawn[line.id] = rounds[key].get(line.id, Drawn("none that the recipe draws"))
    return Reenacting(drawn)


def _round(
    told: Told, tasks: Sequence[Task], part: str, type_name: str, number: int, seed: int
) -> dict[str, Drawn]:
    """What is drawn when each task of a type has its turn once, by id."""
    of_type = [task for task in tasks if task.type.name == type_name]
    sequence = CandidateSequence(
        part, told.recipe.parts[part], of_type, seed, says_part=told.says_part(part)
    )
    first = number * len(of_type)
    every = (sequence[index] for index in range(first, first + len(of_type)))
    return {one.id: Drawn(one.kind, one.mode, one.explorer) for one in every}


@dataclass(frozen=True)
class Told:
    """What a collection's settings tell of its agents.

    Attributes:
        settings: of the manifest.
        recipe, play: in them.
    """

    settings: Mapping[str, Any]
    recipe: Recipe
    play: PlaySettings

    @property
    def selects(self) -> bool:
        """Whether episodes of runs were taken."""
        return "selects" in self.settings

    @property
    def from_runs(self) -> bool:
        """Whether the trajectories come from episodes of runs."""
        return self.selects or "corrects" in self.settings

    @property
    def model_decides(self) -> bool:
        """Whether a model decided every action."""
        return bool(self.settings.get("expert", {}).get("decisions") == "model")

    @property
    def model_plans(self) -> bool:
        """Whether a model chose the places that an expert searched."""
        return bool(self.settings.get("expert", {}).get("places") == "model")

    def says_part(self, part: str) -> bool:
        """Whether ids name the part, as :func:`agents.expert.collect.recipe_strata` has it."""
        mine = {*self.recipe.parts[part].all_kinds}
        others = (row.all_kinds for name, row in self.recipe.parts.items() if name != part)
        return any(mine & {*kinds} for kinds in others)

    def writes(self, trajectory: Trajectory) -> bool:
        """Whether er-gym's own writer wrote the thoughts, and no model before it."""
        if "expert" in self.settings:
            return False
        thoughts = [each for turn in trajectory.turns for each in turn.thoughts]
        if trajectory.kind not in QUOTING and self.settings["writer"] == GROUNDED:
            return True
        return all(each.writer == GROUNDED for each in thoughts)

    def candidate(self, task: Task, trajectory: Trajectory, drawn: Drawn) -> Candidate:
        """The candidate that a trajectory is said to be."""
        said = trajectory.correction
        row = self.recipe.parts[trajectory.part]
        turns = trajectory.turns
        beginning = None
        if said is not None:
            repeated = tuple(turn.action for turn in turns[: said.first_wrong + 1])
            beginning = Beginning(repeated, agent=said.agent)
        return Candidate(
            id=trajectory.id,
            part=trajectory.part,
            actor=self.settings["expert"]["name"] if self.model_decides else row.actor,
            task=task,
            index=0,
            kind=drawn.kind,
            mode=drawn.mode,
            explorer=drawn.explorer,
            strength=row.explorers.get(drawn.explorer) if beginning is None else None,
            beginning=beginning,
            correct_by=str(self.settings.get("correct_by", EXPERT)),
            run=said.run if said else "",
            episode=said.episode if said else "",
            repeats=row.repeats,
        )

    def attempt(self, candidate: Candidate, trajectory: Trajectory) -> Attempt | None:
        """The failed episode that a correction begins with, if it was played for that alone."""
        if candidate.beginning is None or candidate.run != ATTEMPT or not candidate.explorer:
            return None
        strength = self.recipe.parts[candidate.part].explorers[candidate.explorer]
        anew = Candidate(
            id=candidate.id,
            part=candidate.part,
            actor=candidate.actor,
            task=candidate.task,
            index=0,
            kind=candidate.kind,
            strength=strength,
        )
        return Attempt(
            anew.course(trajectory.seed, self.play.kinds), len(candidate.beginning.actions)
        )


@lru_cache(maxsize=1)
def _settings_of(stated: str) -> Told:
    manifest = CollectionManifest.model_validate_json(stated)
    settings = manifest.settings
    try:
        kinds = ThoughtKinds.model_validate(settings["thoughts"])
        play = PlaySettings(kinds, None, settings["language"])
        check_corrector(str(settings.get("correct_by", EXPERT)))
        return Told(settings, Recipe.model_validate(settings["recipe"]), play)
    except ValidationError as error:
        raise CollectionError(
            f"this er-gym does not know the settings of the collection ({first_problem(error)}); "
            f"verify it with the one that collected it, {manifest.er_gym}"
        ) from error
    except ValueError as error:
        raise CollectionError(
            f"the settings of the collection say who corrected it, but {error}; verify it with the "
            f"er-gym that collected it, {manifest.er_gym}"
        ) from error


def _told(manifest: CollectionManifest) -> Told | None:
    """What the settings tell; None where no agent of er-gym's played.

    Raises:
        CollectionError: they are those of another version.
    """
    if "recipe" not in manifest.settings:
        return None
    return _settings_of(manifest.model_dump_json())


def _course(candidate: Candidate, trajectory: Trajectory, told: Told) -> Course:
    if told.selects:
        return ReplayedCourse(candidate.task, trajectory.turns)  # type: ignore[arg-type]
    if told.model_decides:
        return DecidedCourse(candidate.task, trajectory.turns)
    if candidate.beginning is not None and candidate.correct_by.startswith(PREFIX):
        # A policy's choice is the largest of numbers, which another machine may round otherwise.
        repeated = candidate.beginning.actions
        decided = [turn.action for turn in trajectory.turns[len(repeated) :]]
        return TakeoverCourse(candidate.task, repeated, RecordedTakesOver(decided))
    return candidate.course(trajectory.seed, told.play.kinds)
