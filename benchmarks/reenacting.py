"""Plays the trajectories of ``er-gym collect`` anew, beside a replay: what was decided, and why.

All that scripted agents decide, and what the grounded writer writes, follows from the seed of an
episode, and which episode that is from the collection's recipe and seed. So whatever they record
can be derived (:class:`Reenacting`); of a model's decisions and words it cannot.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from pydantic import ValidationError

from agents.expert.candidates import Candidate, CandidateSequence
from agents.expert.corrections import Beginning
from agents.expert.course import Course, Intent, View
from agents.expert.legs import at_hand, legs_of
from agents.expert.players import PlaySettings, header_of
from agents.expert.prescreen import ATTEMPT
from agents.expert.recipe import Recipe
from agents.expert.replayed import ReplayedCourse
from agents.expert.replayed_intents import replayed_purpose
from agents.expert.thinker import ThinkingAgent
from agents.expert.thought_kinds import ThoughtKinds
from agents.expert.writers.base import ThoughtRequest, ThoughtWriter, WrittenThoughts
from agents.expert.writers.registry import checked_grounded
from er_gym.data.collection import CollectionError, CollectionManifest
from er_gym.data.line_index import Line
from er_gym.data.train_rule import QUOTING
from er_gym.data.trajectory import Subgoal, ThoughtRecord, Trajectory, Turn
from er_gym.tasks import verbs
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
            beginning = Beginning(tuple(turn.action for turn in turns[: said.first_wrong + 1]))
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
            correct_by=self.settings.get("correct_by", "expert"),
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
        return Told(settings, Recipe.model_validate(settings["recipe"]), play)
    except ValidationError as error:
        raise CollectionError(
            f"this er-gym does not know the settings of the collection ({first_problem(error)}); "
            f"verify it with the one that collected it, {manifest.er_gym}"
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
    return candidate.course(trajectory.seed, told.play.kinds)


class DecidedCourse:
    """Does again what a model decided; :class:`~agents.expert.course.Course`.

    Args:
        task: the task.
        turns: the recorded ones.
    """

    view: View

    def __init__(self, task: Task, turns: Sequence[Turn]) -> None:
        self._legs, self._turns = legs_of(task), turns

    def intents(self) -> Iterator[Intent]:
        """What was decided, with the reasons as :class:`~agents.expert.decider.DecidingAgent`
        infers them."""
        for turn in self._turns:
            here = at_hand(self._legs, self.view.left)
            yield Intent(
                turn.action,
                replayed_purpose(turn.action, self.view.held),
                here[1] if here else Subgoal(),
                plan=(turn.object_type,) if turn.verb == verbs.NAVIGATE else (),
            )


class Witness:
    """Hears which thoughts are asked for, and says those that were recorded;
    :class:`~agents.expert.writers.base.ThoughtWriter`.

    Args:
        turns: the recorded ones.
        writer: writes the thoughts that they should have; None if only their kinds are known.
    """

    name = "witness"

    def __init__(self, turns: Sequence[Turn], writer: ThoughtWriter | None) -> None:
        self._turns, self._writer = turns, writer
        self.writes = writer is not None
        self.request: ThoughtRequest | None = None
        self.thoughts: list[ThoughtRecord] = []

    def write(self, request: ThoughtRequest) -> WrittenThoughts:
        """Remember what is asked for, and what should be written."""
        recorded = self._turns[request.knowledge.turn].thoughts
        self.request = request
        if self._writer is not None:
            self.thoughts = [*self._writer.write(request).thoughts]
        else:
            there = [*recorded, *[ThoughtRecord(kind="planning", text="")] * len(request.kinds)]
            pairs = zip(request.kinds, there, strict=False)
            self.thoughts = [each.model_copy(update={"kind": kind}) for kind, each in pairs]
        return WrittenThoughts(tuple(recorded))


class Attempt:
    """The course of an episode that fails, up to its first mistake.

    Args:
        course: of the episode.
        length: how many of its actions are repeated.
    """

    def __init__(self, course: Course, length: int) -> None:
        self._course, self._left = course, length
        self._intents: Iterator[Intent] | None = None

    def next(self, info: Mapping[str, Any]) -> Mapping[str, Any]:
        """The verb and the object of the next action; empty after the last."""
        if not self._left:
            return {}
        self._left -= 1
        self._course.view = View.of(info)
        if self._intents is None:
            self._intents = self._course.intents()
        action = next(self._intents).action
        return {"verb": action.verb, "object_type": action.object_type}


class Reenacted:
    """One trajectory; :class:`er_gym.data.reenactment.Reenactment`.

    Args:
        header: see there.
        task: the trajectory's.
        agent: decides anew; None if nothing tells how.
        witness: of the agent's thoughts.
        attempt: the beginning of a correction; None if it is not known.
    """

    def __init__(
        self,
        header: Mapping[str, Any],
        task: Task,
        agent: ThinkingAgent | None,
        witness: Witness,
        attempt: Attempt | None,
    ) -> None:
        self.header = header
        self._task, self._agent, self._witness, self._attempt = task, agent, witness, attempt

    def decide(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Mapping[str, Any]:
        """See :class:`er_gym.data.reenactment.Reenactment`."""
        if self._agent is None:
            return {}
        if self._witness.request is None:
            self._agent.reset(self._task, obs, info)
        tried = self._attempt.next(info) if self._attempt else {}
        self._agent.act(obs, info)
        request = self._witness.request
        assert request is not None
        known = request.knowledge
        told = {
            "verb": known.decision.verb,
            "object_type": known.decision.object_type,
            **tried,
            "purpose": known.purpose,
            "subgoal": known.subgoal,
            "plan": [*known.plan],
        }
        return told if self._quoted else {**told, "thoughts": self._witness.thoughts}

    @property
    def _quoted(self) -> bool:
        """Whether the thoughts are those of an agent that decided itself."""
        return self.header["kind"] in QUOTING and not self._witness.writes
