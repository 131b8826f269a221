"""Collect trajectories: play candidates, part by part, until enough are taken."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from typing import Any

from agents.expert.candidates import (
    Candidate,
    Candidates,
    CandidateSequence,
    FixedCandidates,
)
from agents.expert.corrections import (
    SEVERAL,
    Beginning,
    CorrectAfter,
    correction_points,
)
from agents.expert.explorer import Strength
from agents.expert.players import Players, PlaySettings
from agents.expert.prescreen import prescreen
from agents.expert.recipe import CORRECTED, Part, Recipe, quotas
from agents.expert.recorded_replies import recorded_replies
from agents.expert.recorder import joined_modes
from agents.expert.successors import EXPERT
from er_gym.data.collection import Collection, CollectionError
from er_gym.data.trajectory import Language, Trajectory
from er_gym.envs.actions import Action
from er_gym.rollout.events import Cost, EventListener
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.runner import run
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME

CORRECTIONS = "corrections"
"""The part of the corrected episodes of a run."""
_FRUITLESS_ROUNDS = 6
"""A task type of a part of which nothing was chosen in this many rounds is given up; so it is if
none of those chosen was taken in so many rounds."""
_MOST_AT_ONCE = 20_000
"""No more candidates of a part and task type are looked at in one round, for the memory's sake."""
_PRIOR = 20
"""The expected share of a part weighs as much as this many candidates looked at."""


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
        corrector_observes: the observations that who takes over needs besides the players'.
    """

    recipe: Recipe
    tasks: Sequence[Task]
    env: Mapping[str, Any]
    play: PlaySettings
    seed: int
    manifest: Mapping[str, Any]
    corrector_observes: str = ""


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
        expected: the share of candidates that is expected to be taken; it only decides how many
            are looked at in one round.
        looked_at: how many candidates have been looked at.
        chosen: those that are to be played, in order.
        taken: those taken, in order.
        fruitless: rounds in a row in which none was chosen.
        in_vain: rounds in a row in which none of the chosen was taken.
    """

    sequence: Candidates
    quota: int
    expected: float = 1.0
    looked_at: int = 0
    chosen: list[Candidate] = field(default_factory=list)
    taken: list[Candidate] = field(default_factory=list)
    fruitless: int = 0
    in_vain: int = 0

    @property
    def missing(self) -> int:
        """How many candidates must still be chosen to fill the quota."""
        return self.quota - len(self.taken) - len(self.chosen)

    @property
    def open(self) -> bool:
        """Whether there are more candidates to try."""
        exhausted = self.sequence.length is not None and self.looked_at >= self.sequence.length
        given_up = max(self.fruitless, self.in_vain) >= _FRUITLESS_ROUNDS
        return self.missing > 0 and not given_up and not exhausted

    def next(self) -> list[Candidate]:
        """The candidates of the next round: as many as will probably be needed."""
        found = len(self.taken) + len(self.chosen)
        share = (found + self.expected * _PRIOR) / (self.looked_at + _PRIOR)
        missing = min(self.missing, _MOST_AT_ONCE)
        return self._following(min(round(missing / share) + 1, 8 * missing + 8))

    def next_chosen(self) -> None:
        """Choose as many candidates as are missing, unseen, without gaps: which candidates are
        played must not depend on how many are wanted."""
        self.chosen += self._following(self.missing)

    def _following(self, number: int) -> list[Candidate]:
        number = min(number, _MOST_AT_ONCE)
        if self.sequence.length is not None:
            number = min(number, self.sequence.length - self.looked_at)
        first = self.looked_at
        self.looked_at += number
        return [self.sequence[index] for index in range(first, first + number)]

    def choose(self, fit: Sequence[Candidate]) -> None:
        """Choose candidates of a round, in order, until there are enough."""
        more = fit[: self.missing]
        self.chosen += more
        self.fruitless = 0 if more else self.fruitless + 1

    def take(self, fit: Sequence[Candidate]) -> None:
        """Take the chosen candidates that were played and are accepted; drop the others."""
        if self.chosen:
            self.in_vain = 0 if fit else self.in_vain + 1
        self.taken += fit
        self.chosen.clear()


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
    kinds = Counter(kind for part in recipe.parts.values() for kind in part.all_kinds)
    strata = {}
    for (part, kind), number in wanted.items():
        row = recipe.parts[part]
        alike = any(kinds[each] > 1 for each in row.all_kinds)
        sequence = CandidateSequence(part, row, by_type[kind], settings.seed, says_part=alike)
        if number:
            strata[part, kind] = Stratum(sequence, number, row.expected)
    return strata


def correction_strata(
    tasks: Sequence[Task],
    run_directory: RunDirectory,
    limit: int | None,
    after: CorrectAfter = "wrong",
    by: str = EXPERT,
    max_steps: int | None = None,
    own_thoughts_in: Language | None = None,
) -> tuple[dict[tuple[str, str], Stratum], dict[str, int]]:
    """The failed episodes of a run, as candidates to be corrected.

    Args:
        tasks: the tasks of the run's suite.
        run_directory: the run.
        limit: how many trajectories in all; None for as many as there are.
        after: the action after which another agent takes over.
        by: the agent that takes over (:func:`agents.expert.successors.check_corrector`).
        max_steps: the step limit of the corrections; None for that of the episodes.
        own_thoughts_in: the language of the collection, if what its trajectories repeat is to keep
            the thoughts of the agent that failed.

    Returns:
        The candidates, all in the part :data:`CORRECTIONS`; and how many episodes cannot be
        corrected, by the reason.
    """
    by_id = {task.id: task for task in tasks}
    candidates: list[Candidate] = []
    left_out: dict[str, int] = {}
    begun: set[tuple[str, tuple[Action, ...]]] = set()
    for episode in run_directory.episodes():
        task = by_id.get(episode.task_id)
        beginnings = correction_points(episode, after, max_steps)
        if own_thoughts_in and task and not any(one.problem for one in beginnings):
            beginnings = _with_own_thoughts(beginnings, run_directory, episode, own_thoughts_in)
        for beginning in beginnings:
            problem = beginning.problem if task else "its task is not among the suite's"
            if not problem and (episode.task_id, beginning.actions) in begun:
                problem = "another sample of its task begins alike"
            begun.add((episode.task_id, beginning.actions))
            if task is None or problem:
                left_out[problem] = left_out.get(problem, 0) + 1
                continue
            where = f"-{len(beginning.actions)}" if after in SEVERAL else ""
            candidates.append(
                Candidate(
                    id=f"{episode.key}-{CORRECTED}{where}",
                    part=CORRECTIONS,
                    actor="corrector",
                    task=task,
                    index=len(candidates),
                    kind=CORRECTED,
                    beginning=beginning,
                    correct_by=by,
                    run=run_directory.path.resolve().name,
                    episode=episode.key,
                )
            )
    if not candidates:
        return {}, left_out
    quota = len(candidates) if limit is None else min(limit, len(candidates))
    return {(CORRECTIONS, ""): Stratum(FixedCandidates(candidates), quota)}, left_out


def _with_own_thoughts(
    beginnings: Sequence[Beginning], run: RunDirectory, episode: EpisodeRecord, language: Language
) -> list[Beginning]:
    """The beginnings of a failed episode with what its agent thought; one that has a ``problem`` if
    that is not recorded, or in another language."""
    words = recorded_replies(run.path, episode)
    if words is None or words.silent:
        return [Beginning(problem="its agent left no thoughts")]
    if words.language != language:
        return [Beginning(problem=f"its agent thought in {words.language}, not in {language}")]
    said = tuple(turn.thoughts for turn in words.turns)
    agent = run.manifest.agent
    return [replace(one, agent=agent, said=said[: len(one.actions)]) for one in beginnings]


def corrections_recipe(max_steps: int | None = None) -> Recipe:
    """The recipe of a collection that corrects a run: one part, whatever the task types.

    Args:
        max_steps: the step limit of the corrections, if it is not that of the tasks.
    """
    types = dict.fromkeys(BY_NAME, 1)
    part = Part(actor="corrector", types=types, explorers={"run": Strength()})
    if max_steps is not None:
        part = part.model_copy(update={"most_actions": max(part.most_actions, max_steps)})
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
                :func:`er_gym.rollout.runner.run`; what was collected so far is written, and what
                an earlier command had collected stays.
            RunDirectoryError, Locked, ForeignFile: the directory of a part cannot be used.
        """
        try:
            for part in self._settings.recipe.parts:
                strata = [one for (name, _), one in self._strata.items() if name == part]
                if strata:
                    self._collect_part(part, strata)
        except BaseException:  # Ctrl-C too
            self.summary.taken = self._collection.write(self._taken_and_earlier())
            raise
        self.summary.taken = self._collection.write(self._taken())
        for key, stratum in self._strata.items():
            if stratum.missing > 0:
                self.summary.missing[key] = stratum.missing
        return self.summary

    def _taken(self) -> Iterator[Trajectory]:
        for stratum in self._strata.values():
            for candidate in stratum.taken:
                yield self._collection.played(candidate.part, candidate.id)

    def _taken_and_earlier(self) -> Iterator[Trajectory]:
        """The trajectories taken now, then those that were in the file before."""
        now = set()
        for trajectory in self._taken():
            now.add((trajectory.part, trajectory.id))
            yield trajectory
        with suppress(CollectionError):  # there is no file yet, or it is damaged
            for trajectory in self._collection.trajectories():
                if (trajectory.part, trajectory.id) not in now:
                    yield trajectory

    # -- one part --------------------------------------------------------------------------------

    def _collect_part(self, part: str, strata: Sequence[Stratum]) -> None:
        row = self._settings.recipe.parts[part]
        env: dict[str, Any] = dict(self._settings.env)
        if row.faults:
            env["faults"] = row.faults
        with self._part_directory(part, {**env, "obs_mode": self._obs_mode}) as directory:
            while True:
                self._choose_enough(strata, env, row.most_actions)
                if not any(stratum.chosen for stratum in strata):
                    break
                try:
                    self._play(directory, strata, row.most_actions)
                finally:  # what was played before an interruption is taken, too
                    for stratum in strata:
                        self._take(directory, stratum, row.most_actions)
                    self.summary.taken = sum(len(one.taken) for one in self._strata.values())
                    self._tell(part, self.summary.taken)

    @property
    def _obs_mode(self) -> str:
        """What the players need to observe, without pictures if none are recorded."""
        modes = self._players.obs_mode.split("+")
        if self._settings.play.pictures is None:
            modes.remove("rgb")
        return joined_modes(*modes, self._settings.corrector_observes)

    def _choose_enough(self, strata: Sequence[Stratum], env: Mapping[str, Any], most: int) -> None:
        """Choose candidates to be played until there are enough, or no more."""
        if not self._players.scripted:
            for stratum in strata:
                if stratum.open:
                    stratum.next_chosen()
            return
        while any(stratum.open for stratum in strata):
            self._choose(strata, env, most)

    def _choose(self, strata: Sequence[Stratum], env: Mapping[str, Any], most: int) -> None:
        """Look at more candidates, and choose those that a prescreening shows to be fit."""
        rounds = [(stratum, stratum.next()) for stratum in strata if stratum.open]
        fit: dict[str, Candidate] = {}
        for prescreened in prescreen(
            [each for _, candidates in rounds for each in candidates],
            env=env,
            observes=self._settings.corrector_observes,
            seed=self._settings.seed,
            kinds=self._settings.play.kinds,
            most_actions=most,
            workers=self._parallelism.workers,
            worker_backend=self._parallelism.worker_backend,
        ):
            if prescreened.reason:
                self._reject(prescreened.reason)
            else:
                fit[prescreened.candidate.id] = prescreened.candidate
        for stratum, candidates in rounds:
            stratum.choose([fit[one.id] for one in candidates if one.id in fit])

    @contextmanager
    def _part_directory(self, part: str, env: Mapping[str, Any]) -> Iterator[RunDirectory]:
        settings = self._settings
        row = settings.recipe.parts[part]
        manifest = Manifest(
            suite=settings.manifest["suite"],
            suite_digest=settings.manifest["suite_digest"],
            suite_size=len(settings.tasks),
            agent=self._players.name or row.actor,
            agent_settings=settings.manifest["settings"],
            env=dict(env),
            seed=settings.seed,
            er_gym=settings.manifest["er_gym"],
        )
        path = self._collection.part_path(part)
        with RunDirectory.locked(path, manifest) as directory:
            yield directory

    def _play(self, directory: RunDirectory, strata: Sequence[Stratum], most: int) -> None:
        """Play the chosen candidates with pictures and thoughts."""
        chosen = {each.id: each for stratum in strata for each in stratum.chosen}
        self._forget_damaged(directory, chosen.values(), most)
        summary = run(
            directory,
            _by_scene(each.played_task for each in chosen.values()),
            self._players.make(chosen, self._settings.play, most),
            executor=self._executor,
            parallelism=self._parallelism,
            listeners=self._listeners,
            cost=self._cost,
            seeds={each.id: each.seed for each in chosen.values() if each.seed is not None},
        )
        self.summary.played += summary.played
        self.summary.crashed += [f"{each.task_id}: {each.error}" for each in summary.crashed]

    def _forget_damaged(
        self, directory: RunDirectory, candidates: Iterable[Candidate], most: int
    ) -> None:
        """Let episodes be played again whose trajectory or pictures are damaged or gone."""
        for each in candidates:
            if directory.has(each.id) and not self._is_whole(each, most):
                directory.forget(each.id)

    def _is_whole(self, candidate: Candidate, most: int) -> bool:
        try:
            trajectory = self._collection.played(candidate.part, candidate.id)
        except CollectionError:
            return False
        if self._players.rejection(trajectory, most):
            return True  # pictures of what is not taken are not kept
        return self._collection.has_pictures(trajectory)

    def _take(self, directory: RunDirectory, stratum: Stratum, most: int) -> None:
        """Take the chosen candidates that were played and came out well, in order."""
        fit = []
        for candidate in stratum.chosen:
            if not directory.has(candidate.id):  # its files may not be whole
                continue
            try:
                trajectory = self._collection.played(candidate.part, candidate.id)
            except CollectionError:  # it crashed, as the summary says, or was not played
                continue
            reason = self._players.rejection(trajectory, most)
            if reason:
                self._reject(reason)
            else:
                fit.append(candidate)
        stratum.take(fit)

    def _reject(self, reason: str) -> None:
        self.summary.rejected[reason] = self.summary.rejected.get(reason, 0) + 1


def _by_scene(tasks: Iterable[Task]) -> list[Task]:
    """Tasks in an order in which a worker's room stays warm."""
    return sorted(tasks, key=lambda task: (task.scene, task.id))
