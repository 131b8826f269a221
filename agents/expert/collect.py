"""Collect trajectories: play candidates, part by part, until enough are taken."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from agents.expert.candidates import (
    Candidate,
    Candidates,
    CandidateSequence,
    FixedCandidates,
)
from agents.expert.corrections import beginning_of
from agents.expert.explorer import Strength
from agents.expert.players import MakeSilent, Players, PlaySettings
from agents.expert.recipe import CORRECTED, Part, Recipe, quotas
from er_gym.data.collection import Collection, CollectionError
from er_gym.data.trajectory import Trajectory
from er_gym.rollout.events import Cost, EventListener
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.run_directory import Manifest, RunDirectory, locked_run_directory
from er_gym.rollout.runner import run
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME

ATTEMPTS = "attempts"
"""The suffix of the run directory with the explorers' attempts that a part corrects."""
CORRECTIONS = "corrections"
"""The part of the corrected episodes of a run."""
_MOST_ROUNDS = 40
_FRUITLESS_ROUNDS = 3
"""A task type of a part of which nothing was taken in this many rounds is given up."""


@dataclass(frozen=True)
class CollectSettings:
    """What decides the trajectories of a collection.

    Attributes:
        recipe: how many of what.
        tasks: the suite's tasks.
        env: keyword arguments of the environment, without ``obs_mode`` and ``faults``.
        play: what all players share.
        seed: of everything that is drawn.
        manifest: what the parts' manifests have in common with the collection's.
    """

    recipe: Recipe
    tasks: Sequence[Task]
    env: Mapping[str, Any]
    play: PlaySettings
    seed: int
    manifest: Mapping[str, Any]


@dataclass
class CollectSummary:
    """What :func:`collect` did.

    Attributes:
        taken: how many trajectories are in the collection.
        wanted: how many there should be.
        played: how many episodes were played now.
        rejected: how many trajectories were not taken, by the reason.
        crashed: the errors of episodes that crashed.
        missing: by part and task type, how many could not be had.
    """

    taken: int = 0
    wanted: int = 0
    played: int = 0
    rejected: dict[str, int] = field(default_factory=dict)
    crashed: list[str] = field(default_factory=list)
    missing: dict[tuple[str, str], int] = field(default_factory=dict)


@dataclass(eq=False)
class Stratum:
    """The candidates of one part and task type, and which of them were taken.

    Attributes:
        sequence: the candidates.
        quota: how many to take.
        played: how many candidates have been looked at.
        taken: those taken, in order.
        fruitless: rounds in a row in which none was taken.
    """

    sequence: Candidates
    quota: int
    played: int = 0
    taken: list[Candidate] = field(default_factory=list)
    fruitless: int = 0

    @property
    def missing(self) -> int:
        return self.quota - len(self.taken)

    @property
    def open(self) -> bool:
        exhausted = self.sequence.length is not None and self.played >= self.sequence.length
        return self.missing > 0 and self.fruitless < _FRUITLESS_ROUNDS and not exhausted

    def next(self) -> list[Candidate]:
        """The candidates of the next round: as many as are missing, and a few more where many were
        rejected before."""
        yield_so_far = (len(self.taken) + 1) / (self.played + 1)
        number = min(round(self.missing / yield_so_far), 4 * self.missing + 4)
        if self.sequence.length is not None:
            number = min(number, self.sequence.length - self.played)
        first = self.played
        self.played += number
        return [self.sequence[index] for index in range(first, first + number)]


def recipe_strata(settings: CollectSettings, limit: int | None) -> dict[tuple[str, str], Stratum]:
    """What a recipe asks for.

    Args:
        settings: with the recipe, the tasks and the seed.
        limit: how many trajectories in all; None for the recipe's number.

    Raises:
        ValueError: no task has a type that the recipe asks for.
    """
    by_type: dict[str, list[Task]] = {}
    for task in settings.tasks:
        by_type.setdefault(task.type.name, []).append(task)
    recipe = settings.recipe
    wanted = quotas(recipe, limit, set(by_type))
    if not wanted:
        asked = dict.fromkeys(kind for part in recipe.parts.values() for kind in part.types)
        raise ValueError(
            f"none of the tasks is of a type that the recipe asks for: {', '.join(asked)}"
        )
    return {
        (part, kind): Stratum(
            CandidateSequence(part, recipe.parts[part], by_type[kind], settings.seed), number
        )
        for (part, kind), number in wanted.items()
        if number
    }


def correction_strata(
    tasks: Sequence[Task], run_directory: RunDirectory, limit: int | None
) -> tuple[dict[tuple[str, str], Stratum], dict[str, int]]:
    """The failed episodes of a run, as candidates to be corrected.

    Args:
        tasks: the tasks of the run's suite.
        run_directory: the run.
        limit: how many trajectories in all; None for as many as there are.

    Returns:
        The candidates, all in the part :data:`CORRECTIONS`; and how many episodes cannot be
        corrected, by the reason.
    """
    by_id = {task.id: task for task in tasks}
    candidates: list[Candidate] = []
    left_out: dict[str, int] = {}
    for episode in run_directory.episodes():
        task = by_id.get(episode.task_id)
        beginning = beginning_of(episode)
        problem = beginning.problem if task else "its task is not among the suite's"
        if task is None or problem:
            left_out[problem] = left_out.get(problem, 0) + 1
            continue
        candidates.append(
            Candidate(
                id=f"{task.id}-{CORRECTED}",
                part=CORRECTIONS,
                actor="corrector",
                task=task,
                index=len(candidates),
                kind=CORRECTED,
                beginning=beginning,
                run=run_directory.path.name,
                episode=episode.task_id,
            )
        )
    if not candidates:
        return {}, left_out
    quota = len(candidates) if limit is None else min(limit, len(candidates))
    return {(CORRECTIONS, ""): Stratum(FixedCandidates(candidates), quota)}, left_out


def corrections_recipe() -> Recipe:
    """The recipe of a collection that corrects a run: one part, whatever the task types."""
    types = dict.fromkeys(BY_NAME, 1)
    part = Part(actor="corrector", types=types, explorers={"run": Strength()})
    return Recipe(parts={CORRECTIONS: part})


class Collector:
    """Plays candidates until every part has its number.

    Args:
        collection: where to.
        settings: what decides the trajectories.
        players: who plays; what they make is picklable for ``executor="processes"``.
        strata: the candidates by part and task type, and how many of each are wanted.
        executor, parallelism: as :func:`er_gym.rollout.runner.run` takes them.
        listeners: hear of every event of the runs.
        cost: what the thoughts have cost so far.
        tell: hears the present part, and how many trajectories are taken so far.
    """

    def __init__(
        self,
        collection: Collection,
        settings: CollectSettings,
        players: Players,
        strata: Mapping[tuple[str, str], Stratum],
        *,
        executor: str = "processes",
        parallelism: Parallelism = Parallelism(),  # noqa: B008 (frozen)
        listeners: Iterable[EventListener] = (),
        cost: Callable[[], Cost | None] = lambda: None,
        tell: Callable[[str, int], None] = lambda part, taken: None,
    ) -> None:
        self._tell = tell
        self._collection, self._settings, self._players = collection, settings, players
        self._executor, self._parallelism = executor, parallelism
        self._listeners, self._cost = tuple(listeners), cost
        self._strata = strata
        self.summary = CollectSummary(wanted=sum(one.quota for one in strata.values()))

    def collect(self) -> CollectSummary:
        """Collect what is missing, and write ``trajectories.jsonl``, also when interrupted.

        Raises:
            Stopped, WorkerSetupError, KeyboardInterrupt, OSError: as
                :func:`er_gym.rollout.runner.run`; what was collected so far is written.
        """
        try:
            for part in self._settings.recipe.parts:
                strata = [one for (name, _), one in self._strata.items() if name == part]
                if strata:
                    self._collect_part(part, strata)
        finally:
            self.summary.taken = self._collection.write(self._taken())
        for key, stratum in self._strata.items():
            if stratum.missing > 0:
                self.summary.missing[key] = stratum.missing
        return self.summary

    def _taken(self) -> Iterator[Trajectory]:
        for stratum in self._strata.values():
            for candidate in stratum.taken:
                yield self._collection.played(candidate.part, candidate.id)

    # -- one part --------------------------------------------------------------------------------

    def _collect_part(self, part: str, strata: Sequence[Stratum]) -> None:
        row = self._settings.recipe.parts[part]
        env: dict[str, Any] = {**self._settings.env, "obs_mode": self._players.obs_mode}
        if row.faults:
            env["faults"] = row.faults
        with self._part_directory(part, env) as directory:
            for _ in range(_MOST_ROUNDS):
                rounds = [(stratum, stratum.next()) for stratum in strata if stratum.open]
                if not rounds:
                    break
                candidates = [each for _, chosen in rounds for each in chosen]
                ready = self._ready(part, candidates)
                try:
                    self._play(directory, ready, row.most_actions)
                finally:  # what a round that was stopped has played is taken too
                    for stratum, chosen in rounds:
                        self._judge(stratum, [ready[one.id] for one in chosen if one.id in ready])
                    self.summary.taken = sum(len(one.taken) for one in self._strata.values())
                    self._tell(part, self.summary.taken)

    @contextmanager
    def _part_directory(self, part: str, env: Mapping[str, Any]) -> Iterator[RunDirectory]:
        settings = self._settings
        row = settings.recipe.parts.get(part.removesuffix(f"-{ATTEMPTS}"))
        manifest = Manifest(
            suite=settings.manifest["suite"],
            suite_digest=settings.manifest["suite_digest"],
            suite_size=len(settings.tasks),
            agent=self._players.name or (row.actor if row else "explorer"),
            agent_settings=settings.manifest["settings"],
            env=dict(env),
            seed=settings.seed,
            er_gym=settings.manifest["er_gym"],
        )
        path = self._collection.part_path(part)
        with locked_run_directory(path, manifest) as directory:
            yield directory

    def _ready(self, part: str, candidates: Sequence[Candidate]) -> dict[str, Candidate]:
        """The candidates that can be played, by id; corrections get their failed attempts."""
        if not candidates or candidates[0].actor != "corrector" or candidates[0].beginning:
            return {each.id: each for each in candidates}
        attempts = f"{part}-{ATTEMPTS}"
        env = {**self._settings.env, "obs_mode": "objects"}
        with self._part_directory(attempts, env) as directory:
            tasks = _by_scene(each.played_task for each in candidates)
            make = MakeSilent({each.id: each for each in candidates}, self._settings.play.kinds)
            self._run(directory, tasks, make, "processes")
            wanted = {each.id: each for each in candidates}
            ready = {}
            for episode in directory.episodes():
                candidate = wanted.get(episode.task_id)
                if candidate is None:
                    continue
                beginning = beginning_of(episode)
                if beginning.problem:
                    self._reject(f"attempt: {beginning.problem}")
                    continue
                ready[candidate.id] = replace(
                    candidate,
                    beginning=beginning,
                    run=attempts,
                    episode=episode.task_id,
                    strength=None,
                )
        return ready

    def _play(
        self, directory: RunDirectory, candidates: Mapping[str, Candidate], most: int
    ) -> None:
        tasks = _by_scene(each.played_task for each in candidates.values())
        make = self._players.make(candidates, self._settings.play, most)
        self._run(directory, tasks, make, self._executor)

    def _run(
        self, directory: RunDirectory, tasks: Sequence[Task], make: Any, executor: str
    ) -> None:
        summary = run(
            directory,
            tasks,
            make,
            executor=executor,
            parallelism=self._parallelism,
            listeners=self._listeners,
            cost=self._cost,
        )
        self.summary.played += summary.played
        self.summary.crashed += [f"{each.task_id}: {each.error}" for each in summary.crashed]

    def _judge(self, stratum: Stratum, candidates: Sequence[Candidate]) -> None:
        """Take candidates of a round, in order, until the quota is full."""
        before = len(stratum.taken)
        for candidate in candidates:
            if stratum.missing <= 0:
                break
            try:
                trajectory = self._collection.played(candidate.part, candidate.id)
            except CollectionError:  # it crashed, as the summary says, or was not played
                continue
            most = self._settings.recipe.parts[candidate.part].most_actions
            reason = self._players.rejection(trajectory, most)
            if reason:
                self._reject(reason)
            else:
                stratum.taken.append(candidate)
        stratum.fruitless = 0 if len(stratum.taken) > before else stratum.fruitless + 1

    def _reject(self, reason: str) -> None:
        self.summary.rejected[reason] = self.summary.rejected.get(reason, 0) + 1


def _by_scene(tasks: Iterable[Task]) -> list[Task]:
    """Tasks in an order in which a worker's room stays warm."""
    return sorted(tasks, key=lambda task: (task.scene, task.id))
