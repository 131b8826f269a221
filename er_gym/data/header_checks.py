"""What a trajectory says of its task and of where it comes from, derived anew and compared.

:data:`CHECKS` has a row for each group of fields; the page on data lists every field, and from what
it is derived.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

from er_gym.data.collection import CollectionManifest
from er_gym.data.comparing import compared
from er_gym.data.train_rule import QUOTING, own_voice, repeats_own_words
from er_gym.data.trajectory import Cost, Trajectory
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import EpisodeRecord, record_episode
from er_gym.tasks.task import Task

ATTEMPT = "attempt"
"""The run of a failed episode that was played for nothing but to be corrected."""
GROUNDED = "grounded"
"""er-gym's own writer of thoughts."""
_OF_TASK = (
    "task_type",
    "scene",
    "instruction",
    "name",
    "key_actions",
    "search_targets",
)


@dataclass(frozen=True)
class Origin:
    """What a trajectory is checked against.

    Attributes:
        task: its task, with the ids of its scene.
        manifest: the collection's.
    """

    task: Task
    manifest: CollectionManifest

    @cached_property
    def episode(self) -> EpisodeRecord:
        """What any episode of the task records of it."""
        return record_episode(self.task, agent="", seed=0)

    @property
    def settings(self) -> Mapping[str, Any]:
        """What was collected; empty where another program wrote the collection."""
        return self.manifest.settings

    @property
    def selected(self) -> bool:
        """Whether the episodes were played before, in runs with seeds of their own."""
        return "selects" in self.settings

    @property
    def model(self) -> str:
        """The model that took part, ``""`` for none."""
        return str(self.settings.get("expert", {}).get("name", ""))


Check: TypeAlias = Callable[[Origin, Trajectory], Iterator[str]]


def header_problems(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    """The fields of a trajectory, beside its turns, that are not what they should be."""
    for check in CHECKS:
        yield from check(origin, trajectory)


def _task(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    for name in _OF_TASK:
        now = getattr(origin.episode, name)
        yield from compared(name, getattr(trajectory, name), now, "the task")


def _id(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    if not trajectory.id.startswith(origin.task.id):
        yield f"id must begin with that of the task, {origin.task.id!r}"


def _seed(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    if not origin.selected:
        now = episode_seed(origin.manifest.seed, trajectory.id)
        yield from compared("seed", trajectory.seed, now, "the collection's seed and the id")


def _kind(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    kinds = _kinds(origin, trajectory.part)
    if kinds and trajectory.kind not in kinds:
        yield (
            f"kind is {' or '.join(kinds)} in the part {trajectory.part!r}, recorded was "
            f"{trajectory.kind!r}"
        )


def _kinds(origin: Origin, part: str) -> list[str]:
    """The kinds of trajectories that a part may have; empty if the settings do not say so."""
    settings = origin.settings
    if origin.selected:
        return ["played"]
    if settings.get("expert", {}).get("decisions") == "model":
        return ["model"]
    row = settings.get("recipe", {}).get("parts", {}).get(part, {})
    if row.get("actor") == "expert":
        return [kind for kind, share in row["kinds"].items() if share]
    return {"explorer": ["explored"], "corrector": ["corrected"]}.get(row.get("actor"), [])


def _language(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    if not origin.selected and "language" in origin.settings:
        now = origin.settings["language"]
        yield from compared("language", trajectory.language, now, "the collection's settings")


def _cost(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    if not (origin.model or origin.selected):
        yield from compared("cost", trajectory.cost, Cost(), "the settings, which name no model")
        return
    models = {origin.model, trajectory.actor if trajectory.kind in QUOTING else ""} - {""}
    asked = sum(
        any(each.writer in models for each in turn.thoughts)
        for index, turn in enumerate(trajectory.turns)
        if not repeats_own_words(trajectory, index)  # paid for when it was played
    )
    if trajectory.cost.requests < asked:
        yield (
            f"cost.requests is at least {asked}, one for each turn with a model's thoughts, "
            f"recorded was {trajectory.cost.requests}"
        )


def _correction(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    said, settings = trajectory.correction, origin.settings
    if (said is not None) != (trajectory.kind == "corrected"):
        yield f"correction is {said!r:.120}, but the kind is {trajectory.kind!r}"
        return
    if said is None or "recipe" not in settings:
        return
    run, episode = ATTEMPT, trajectory.id
    if "corrects" in settings:  # such as "s1-samples (0123456789abcdef)"
        run, episode = (
            str(settings["corrects"]).rpartition(" (")[0],
            trajectory.id.rpartition("-corrected")[0],
        )
    if bool(said.agent) != bool(settings.get("own_thoughts")):
        yield (
            f"correction.agent is {said.agent!r:.120}, but by the settings the beginning has "
            f"{'its own' if settings.get('own_thoughts') else 'no own'} thoughts"
        )
    yield from compared("correction.run", said.run, run, "the collection's settings")
    yield from compared("correction.episode", said.episode, episode, "the id")
    wrong = next((k for k, turn in enumerate(trajectory.turns) if not turn.earned), -1)
    if {"correct_after", "correct_by"} & settings.keys():
        wrong = min(max(0, said.first_wrong), len(trajectory.turns) - 2)
    yield from compared("correction.first_wrong", said.first_wrong, wrong, "the rewards")


def _writers(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    """Who may have thought; another package's writer may name itself as it likes."""
    named = str(origin.settings.get("writer", GROUNDED))
    if named != GROUNDED:
        return
    for index, turn in enumerate(trajectory.turns):
        writers = {GROUNDED, origin.model, own_voice(trajectory, index)} - {""}
        for number, thought in enumerate(turn.thoughts):
            if thought.writer not in writers:
                yield (
                    f"turn {index}: thoughts[{number}].writer is {' or '.join(sorted(writers))} by "
                    f"the collection's settings, recorded was {thought.writer!r:.120}"
                )


def _actor(origin: Origin, trajectory: Trajectory) -> Iterator[str]:
    if trajectory.kind == "model":
        yield from compared("actor", trajectory.actor, origin.model, "the collection's settings")


CHECKS: tuple[Check, ...] = (
    _task,
    _id,
    _seed,
    _kind,
    _language,
    _cost,
    _correction,
    _writers,
    _actor,
)
